//! Plants: equations of motion, one per file.

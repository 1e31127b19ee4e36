//! stub
/// a
pub struct Account;
/// x
pub fn write_run_folder() {}

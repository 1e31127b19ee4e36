//! Reads a TOML file of any shape, and says everything that is wrong with it: each fault with its line, what was found
//! and what is allowed.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use toml::de::DeTable;

use super::fault::{Collector, Faults};
use super::shape::check_shape;

/// Reads a file; `check` notes what its shape alone does not tell. `name` is what the faults call the file.
///
/// # Errors
/// Everything that is wrong with it.
pub fn read<T: DeserializeOwned + JsonSchema>(
    name: &str,
    text: &str,
    check: impl FnOnce(&mut Collector<'_>, &T),
) -> Result<T, Faults> {
    let mut faults = Collector::new(text);
    let file = shaped(&mut faults, text);
    if let Some(file) = &file {
        check(&mut faults, file);
    }
    match file {
        Some(file) if faults.is_empty() => Ok(file),
        _ => Err(faults.into_faults(name)),
    }
}

/// The file as far as its shape goes; `None` only with a fault noted. With faults in values that serde tolerates (unknown
/// keys) there is a file all the same, so that they are reported together with what is wrong with the values.
pub(super) fn shaped<T: DeserializeOwned + JsonSchema>(faults: &mut Collector<'_>, text: &str) -> Option<T> {
    match DeTable::parse(text) {
        Err(error) => {
            faults.fault_at(error.span().map(|span| span.start), String::new(), error.message().to_string());
            return None;
        }
        Ok(table) => check_shape::<T>(faults, table.get_ref()),
    }
    match toml::from_str(text) {
        Ok(file) => Some(file),
        Err(error) => {
            // The shape check explains it better, unless it let something pass.
            if faults.is_empty() {
                let byte = error.span().map(|span| span.start);
                faults.fault_at(byte, String::new(), error.message().to_string());
            }
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize, JsonSchema)]
    struct Recipe {
        /// How many.
        eggs: i64,
    }

    fn faults(text: &str) -> String {
        let few = |faults: &mut Collector<'_>, recipe: &Recipe| {
            faults.number("eggs", recipe.eggs as f64, recipe.eggs < 3, "at most 2");
        };
        read("cake.toml", text, few).map_or_else(|faults| faults.to_string(), |recipe| format!("{recipe:?}"))
    }

    #[test]
    fn a_file_of_any_shape_is_read_or_refused_with_the_line() {
        assert_eq!(faults("eggs = 2"), "Recipe { eggs: 2 }");
        assert_eq!(faults("\neggs = 9"), "cake.toml:2: eggs: found 9; allowed: at most 2");
        assert_eq!(faults("eggs = 1\nsalt = 1"), "cake.toml:2: salt: found an unknown key; allowed: eggs");
        assert_eq!(faults("eggs = \"two\""), "cake.toml:1: eggs: found a string; allowed: How many");
        assert!(faults("eggs = = 1").starts_with("cake.toml:1: found "));
    }
}

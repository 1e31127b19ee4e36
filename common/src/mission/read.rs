//! Reads a TOML file of any shape, and says everything that is wrong with it: each fault with its line, what was found
//! and what is allowed.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use toml::de::DeTable;

use super::fault::{Collector, Faults};
use super::mend::{WAYS, mended};
use super::shape::check_shape;

/// Reads a file; `check` notes what its shape alone does not tell. `name` is what the faults call the file.
///
/// # Errors
/// Everything that is wrong with it.
pub fn read<T: DeserializeOwned + JsonSchema>(
    name: &str,
    text: &str,
    check: impl Fn(&mut Collector<'_>, &T),
) -> Result<T, Faults> {
    examine(name, text, |faults, file| {
        check(faults, &file);
        Some(file)
    })
}

/// Reads a file and makes something of it, or says everything that is wrong: with its shape and, as far as that can be told,
/// with its values. `make` gives `None` only with a fault noted.
///
/// # Errors
/// Everything that is wrong with it.
pub(super) fn examine<T: DeserializeOwned + JsonSchema, R>(
    name: &str,
    text: &str,
    make: impl Fn(&mut Collector<'_>, T) -> Option<R>,
) -> Result<R, Faults> {
    let mut faults = Collector::new(text);
    let (root, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        // What is left of a text that is no TOML means little.
        no_toml(&mut faults, &errors);
        return Err(faults.into_faults(name));
    }
    let misfits = check_shape::<T>(&mut faults, root.get_ref());
    if !misfits.none() {
        let ways = (0..WAYS).filter_map(|way| {
            let file = mended(root.get_ref(), &misfits, way).try_into().ok()?;
            let mut faults = Collector::new(text);
            make(&mut faults, file);
            Some(faults.into_list())
        });
        faults.add_common(ways.collect(), |key| !misfits.made_up(key));
        return Err(faults.into_faults(name));
    }
    match toml::from_str(text) {
        Ok(file) => match make(&mut faults, file) {
            Some(made) if faults.is_empty() => Ok(made),
            _ => Err(faults.into_faults(name)),
        },
        // The shape check let something pass.
        Err(error) => {
            faults.fault_at(error.span().map(|span| span.start), error.message().to_string(), String::new());
            Err(faults.into_faults(name))
        }
    }
}

/// Where a text is no TOML. The parser goes on after an error as well as it can: of a line only its first complaint counts, and keys that
/// are there twice only if nothing before them can have mixed up the tables.
fn no_toml(faults: &mut Collector<'_>, errors: &[toml::de::Error]) {
    let mut mixed_up = false;
    let mut line_before = None;
    for error in errors {
        let byte = error.span().map(|span| span.start);
        let line = byte.map(|byte| faults.line_of_byte(byte));
        let is_duplicate = error.message().starts_with("duplicate key");
        let is_new = line.is_none() || line != line_before;
        if is_new && !(is_duplicate && mixed_up) {
            let (found, allowed) = match error.message().split_once(", expected ") {
                Some((found, "nothing")) => (found, ""),
                Some((found, allowed)) => (found, allowed),
                None if is_duplicate => ("duplicate key", "each key once"),
                None => (error.message(), ""),
            };
            faults.fault_at(byte, found.to_string(), allowed.to_string());
        }
        mixed_up |= !is_duplicate;
        line_before = line;
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
        assert_eq!(
            faults("eggs = \"two\""),
            "cake.toml:1: eggs: found a string; allowed: an integer from -9223372036854775808 to 9223372036854775807: How many"
        );
        assert_eq!(faults("eggs = 1\neggs = 2"), "cake.toml:2: found duplicate key; allowed: each key once");
        assert_eq!(
            faults("[a\neggs = 1\nflour 2\neggs = 1"),
            "cake.toml:1: found unclosed table; allowed: `]`\n\
             cake.toml:3: found key with no value; allowed: `=`"
        );
        assert!(faults("eggs = = 1").starts_with("cake.toml:1: found "));
    }
}

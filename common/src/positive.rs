//! Checks of the numbers that laws, plants and paths are made of.

/// `value` if it is positive and finite, otherwise what is wrong with it.
pub(crate) fn positive(name: &str, value: f64) -> Result<f64, String> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(format!("{name} must be positive, it is {value}")) }
}

/// `value` if it is zero or positive, and finite; otherwise what is wrong with it.
pub(crate) fn not_negative(name: &str, value: f64) -> Result<f64, String> {
    if value >= 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(format!("{name} must not be negative, it is {value}"))
    }
}

/// `value` if it is finite, otherwise what is wrong with it.
pub(crate) fn finite(name: &str, value: f64) -> Result<f64, String> {
    if value.is_finite() { Ok(value) } else { Err(format!("{name} must be a number, it is {value}")) }
}

#[cfg(test)]
mod tests {
    use super::{finite, not_negative, positive};

    #[test]
    fn what_is_no_number_passes_no_check() {
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(positive("gain", wrong).is_err());
            assert!(not_negative("gain", wrong).is_err());
            assert!(finite("gain", wrong).is_err());
        }
    }

    #[test]
    fn zero_separates_the_checks_and_the_message_names_the_culprit() {
        assert_eq!(positive("k", 0.0), Err("k must be positive, it is 0".to_owned()));
        assert_eq!(not_negative("k", 0.0), Ok(0.0));
        assert!(not_negative("k", -1.0).is_err());
        assert_eq!(finite("k", -1.0), Ok(-1.0));
    }
}

//! What a vehicle differs by from those it hears: ξ_i − ξ_j, on lines (1.1) and on circles, where ξ = s/R (1.2).

use super::{Neighbour, Own};

/// Sums over N_i.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disagreement {
    /// Σ (ξ_i − ξ_j), the i-th row of Lξ; positive when the vehicle is ahead.
    pub ahead: f64,
    /// Σ (η_i/R_i − η_j/R_j), the i-th row of LCη; positive when the vehicle is faster.
    pub faster: f64,
    /// |N_i|.
    pub neighbours: usize,
}

impl Disagreement {
    /// The disagreement of `own` with `neighbours`. One whose values are not finite counts as not heard, so that
    /// no message can make a law answer with NaN.
    pub fn among(own: &Own, neighbours: &[Neighbour]) -> Disagreement {
        let own_speed = c(own) * own.eta;
        let heard = neighbours.iter().filter(|other| other.xi.is_finite() && other.scalar.is_finite());
        heard.fold(Disagreement::default(), |sum, other| Disagreement {
            ahead: sum.ahead + (own.xi - other.xi),
            faster: sum.faster + (own_speed - other.scalar),
            neighbours: sum.neighbours + 1,
        })
    }

    /// The mean of ξ_i − ξ_j over N_i; zero for a vehicle that is alone.
    pub fn mean_ahead(&self) -> f64 {
        self.ahead / self.neighbours.max(1) as f64
    }
}

/// ‖(I − 11ᵀ/n) x‖, the norm of what the coordination states x of a fleet differ from their mean by; zero without vehicles.
pub fn of_fleet(states: impl Iterator<Item = f64> + Clone) -> f64 {
    let (sum, count) = states.clone().fold((0.0, 0u32), |(sum, count), x| (sum + x, count + 1));
    let mean = sum / f64::from(count.max(1));
    states.map(|x| (x - mean) * (x - mean)).sum::<f64>().sqrt()
}

/// C_ii = 1/R_i; zero where R_i is not positive, which no path of this crate has.
pub fn c(own: &Own) -> f64 {
    if own.r > 0.0 { own.r.recip() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::{Disagreement, c, of_fleet};
    use crate::coordination::{Neighbour, Own};

    fn own() -> Own {
        Own { xi: 3.0, eta: 0.5, r: 2.0, ..Own::default() }
    }

    #[test]
    fn a_fleet_differs_by_the_norm_of_the_differences_from_its_mean() {
        assert_eq!(of_fleet([5.0, 1.0, 3.0, 3.0].into_iter()), 8f64.sqrt());
        assert_eq!((of_fleet([7.0].into_iter()), of_fleet(std::iter::empty())), (0.0, 0.0));
    }

    #[test]
    fn the_rows_of_the_laplacian() {
        let neighbours = [
            Neighbour { xi: 1.0, scalar: 0.0, ..Neighbour::default() },
            Neighbour { xi: 4.0, scalar: 0.75, ..Neighbour::default() },
        ];
        let expected = Disagreement { ahead: 1.0, faster: 0.25 - 0.5, neighbours: 2 };
        assert_eq!(Disagreement::among(&own(), &neighbours), expected);
        assert_eq!(expected.mean_ahead(), 0.5);
    }

    #[test]
    fn alone_there_is_none() {
        assert_eq!(Disagreement::among(&own(), &[]).mean_ahead(), 0.0);
    }

    #[test]
    fn what_is_no_number_was_not_heard() {
        let strange = [
            Neighbour { xi: f64::NAN, scalar: 0.0, ..Neighbour::default() },
            Neighbour { xi: 0.0, scalar: f64::INFINITY, ..Neighbour::default() },
        ];
        assert_eq!(Disagreement::among(&own(), &strange), Disagreement::default());
    }

    #[test]
    fn a_path_that_stands_still_gives_no_infinite_gain() {
        assert_eq!((c(&own()), c(&Own { r: 0.0, ..own() }), c(&Own { r: f64::NAN, ..own() })), (0.5, 0.0, 0.0));
    }
}

//! Randomness as named streams: one seed, one independent generator per name.
//!
//! A stream is a function of `(seed, name)` alone, so adding a vehicle or a link never changes what another
//! one draws, and a decision can be replayed without replaying the fleet.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};
use sha2::{Digest, Sha256};

/// Independent numbers that belong to one index of a stream.
pub const LANES: usize = 8;

/// A deterministic stream of random numbers.
#[derive(Clone, Debug)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream called `name` (for example `"loss/auv1->auv2"`) of the run with this `seed`.
    pub fn new(seed: u64, name: &str) -> Stream {
        let digest = Sha256::new().chain_update(seed.to_le_bytes()).chain_update(name.as_bytes()).finalize();
        Stream(ChaCha8Rng::from_seed(digest.into()))
    }
    /// Uniform on \[0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }
    /// The `index`-th number of the stream, uniform on \[0, 1): a function of seed, name and index alone, whatever was
    /// drawn before. Several numbers of one index are taken with `lane` 0, 1, … up to [`LANES`].
    pub fn unit_at(&mut self, index: u64, lane: u8) -> f64 {
        self.0.set_word_pos(u128::from(index) * 16 + u128::from(lane) * 2);
        self.unit()
    }
    /// All numbers of one index at once, by lane: the same as [`Self::unit_at`] gives one by one, for the price of one.
    pub fn units_at(&mut self, index: u64) -> [f64; LANES] {
        self.0.set_word_pos(u128::from(index) * 16);
        std::array::from_fn(|_| self.unit())
    }
    /// Uniform on \[low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }
    /// Uniform on the integers below `bound` (which must be positive).
    pub fn below(&mut self, bound: usize) -> usize {
        ((self.unit() * bound as f64) as usize).min(bound.saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::Stream;

    #[test]
    fn a_stream_is_a_function_of_seed_and_name() {
        let draw = |seed, name| Stream::new(seed, name).unit();
        assert_eq!(draw(1, "a"), draw(1, "a"));
        assert_ne!(draw(1, "a"), draw(1, "b"));
        assert_ne!(draw(1, "a"), draw(2, "a"));
    }

    #[test]
    fn a_number_by_index_does_not_depend_on_what_was_drawn_before() {
        let mut stream = Stream::new(3, "link");
        let (fifth, lane) = (stream.unit_at(5, 0), stream.unit_at(5, 1));
        stream.unit_at(77, 0);
        assert_eq!((stream.unit_at(5, 0), stream.unit_at(5, 1)), (fifth, lane));
        assert_ne!(fifth, lane);
        let together = stream.units_at(5);
        assert_eq!(together[..2], [fifth, lane]);
        assert_eq!(together.map(f64::to_bits), [0, 1, 2, 3, 4, 5, 6, 7].map(|lane| stream.unit_at(5, lane).to_bits()));
    }

    #[test]
    fn the_mean_of_the_unit_stream_is_one_half() {
        let mut stream = Stream::new(7, "mean");
        let mean = (0..100_000).map(|_| stream.unit()).sum::<f64>() / 1e5;
        // Five standard deviations of the mean of 1e5 uniforms: 5 / sqrt(12e5).
        assert!((mean - 0.5).abs() < 5.0 / 12e5f64.sqrt());
    }
}

//! Random numbers that are the same on every machine: splitmix64, keyed by seed, stream and index, so that a message
//! can be made without making those before it.

/// A generator of random numbers.
#[derive(Debug, Clone)]
pub(crate) struct Random(u64);

impl Random {
    /// The numbers of one item (`index`) of one purpose (`stream`) under a seed.
    pub(crate) fn of(seed: u64, stream: u64, index: u64) -> Self {
        let mut random = Self(seed);
        for key in [stream, index] {
            random = Self(random.next_u64() ^ key.wrapping_mul(0xd134_2543_de82_ef95));
        }
        random
    }

    fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in `-half_width..half_width`.
    pub(crate) fn around_zero(&mut self, half_width: f64) -> f64 {
        // The upper 53 bits are a uniform f64 in 0..1.
        let unit = (self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        (2.0 * unit - 1.0) * half_width
    }
}

#[cfg(test)]
mod tests {
    use super::Random;

    #[test]
    fn the_sequence_is_that_of_splitmix64() {
        let mut random = Random(0);
        assert_eq!(random.next_u64(), 0xe220_a839_7b1d_cdaf);
        assert_eq!(random.next_u64(), 0x6e78_9e6a_a1b9_65f4);
    }

    #[test]
    fn keys_give_different_numbers_within_bounds() {
        let draw = |seed, stream, index| Random::of(seed, stream, index).around_zero(2.0);
        let draws = [draw(1, 0, 0), draw(2, 0, 0), draw(1, 1, 0), draw(1, 0, 1)];
        for (at, a) in draws.iter().enumerate() {
            assert!((-2.0..2.0).contains(a));
            assert!(draws[at + 1..].iter().all(|b| a.to_bits() != b.to_bits()));
        }
    }
}

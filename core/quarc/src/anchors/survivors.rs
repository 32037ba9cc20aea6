//! The Gaussians of a sampling that still exist.

/// Which Gaussians of a sampling still exist.
#[derive(Clone, Debug, Default)]
pub struct Survivors {
    alive: Vec<u64>,
    before: Vec<u32>, // number of survivors before each word
    count: usize,
    sampled: usize,
}

impl Survivors {
    /// All Gaussians of a sampling.
    pub fn all(count: usize) -> Self {
        let mut alive = vec![u64::MAX; count / 64];
        alive.push((1 << (count % 64)) - 1);
        let mut survivors = Survivors { alive, before: Vec::new(), count: 0, sampled: count };
        survivors.count_on();
        survivors
    }

    /// The Gaussians with ids `old` that are also in `new`, both ascending; `None` if a new id is
    /// below one of the old ones.
    pub fn find(old: &[u32], new: &[u32]) -> Option<Self> {
        let (mut survivors, mut next) = (Self::all(old.len()), 0);
        for (ids, alive) in old.chunks(64).zip(&mut survivors.alive) {
            if new[next..].starts_with(ids) {
                next += ids.len(); // the usual case: none of them has died
                continue;
            }
            for (bit, id) in ids.iter().enumerate() {
                let is_there = new.get(next) == Some(id);
                *alive &= !(u64::from(!is_there) << bit);
                next += usize::from(is_there);
            }
        }
        survivors.count_on();
        let greatest = old.last().copied();
        (new.get(next).copied() > greatest || next == new.len()).then_some(survivors)
    }

    /// The number of survivors.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The current index of a Gaussian of the sampling; `None` if it has died.
    pub fn place(&self, index: u32) -> Option<u32> {
        if self.count == self.sampled {
            return Some(index);
        }
        let (word, bit) = (index as usize / 64, 1 << (index % 64));
        let left = (self.alive[word] & (bit - 1)).count_ones();
        (self.alive[word] & bit != 0).then(|| self.before[word] + left)
    }

    fn count_on(&mut self) {
        self.before.clear();
        let mut count = 0;
        for word in &self.alive {
            self.before.push(count);
            count += word.count_ones();
        }
        self.count = count as usize;
    }
}

//! Where the Gaussians of a sampling stand after some have died.

/// Which of the Gaussians of a sampling are left.
#[derive(Clone, Debug, Default)]
pub struct Survivors {
    alive: Vec<u64>,
    before: Vec<u32>, // how many are left before each word
    count: usize,
    sampled: usize,
}

impl Survivors {
    /// All of them.
    pub fn all(count: usize) -> Self {
        let mut alive = vec![u64::MAX; count / 64];
        alive.push((1 << (count % 64)) - 1);
        let mut survivors = Survivors { alive, before: Vec::new(), count: 0, sampled: count };
        survivors.count_on();
        survivors
    }

    /// Those of some ascending ids that are among others, ascending too; `None` where an id that
    /// is new stands before one that is not.
    pub fn find(old: &[u32], new: &[u32]) -> Option<Self> {
        let (mut survivors, mut next) = (Self::all(old.len()), 0);
        for (ids, alive) in old.chunks(64).zip(&mut survivors.alive) {
            if new[next..].starts_with(ids) {
                next += ids.len(); // as mostly nobody of them has died
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

    /// How many are left.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The index that a Gaussian has now; `None` if it is gone.
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

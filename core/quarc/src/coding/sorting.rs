//! The elements of a plane by context: how SPEC 8.1 asks them.

/// Elements of one context that stand side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Of the plane's model.
    pub context: u32,
    /// Where they begin.
    pub first: u32,
    /// Where they end; after `first`.
    pub last: u32,
}

impl Run {
    /// Its elements among all.
    #[must_use]
    pub const fn range(self) -> std::ops::Range<usize> {
        self.first as usize..self.last as usize
    }
}

/// The elements of a plane, sorted; may be used again.
#[derive(Clone, Debug, Default)]
pub struct Sorted {
    /// The elements by context, those of one context in their order.
    pub order: Vec<u32>,
    /// Where contexts begin in that order; ascending, and none empty.
    pub runs: Vec<Run>,
    places: Vec<[u32; LANES]>,
}

/// So many elements are looked at in turn, far from each other: none of them waits for what the
/// one before has written.
const LANES: usize = 4;

impl Sorted {
    /// Sort elements by their contexts.
    pub fn sort(&mut self, contexts: &[u16]) {
        let most = usize::from(contexts.iter().copied().max().unwrap_or(0));
        self.places.clear();
        self.places.resize(most + 1, [0; LANES]);
        let places = &mut self.places[..];
        for_each_in_turn(contexts.len(), |lane, element| {
            places[usize::from(contexts[element])][lane] += 1;
        });
        self.find_runs();
        self.order.resize(contexts.len(), 0);
        let (places, order) = (&mut self.places[..], &mut self.order[..]);
        for_each_in_turn(contexts.len(), |lane, element| {
            let place = &mut places[usize::from(contexts[element])][lane];
            order[*place as usize] = element as u32;
            *place += 1;
        });
    }

    /// Make of how many elements each context has where the next of them goes.
    fn find_runs(&mut self) {
        self.runs.clear();
        let mut first = 0;
        for (context, lanes) in self.places.iter_mut().enumerate() {
            let mut last = first;
            for place in lanes {
                last += std::mem::replace(place, last);
            }
            if last > first {
                self.runs.push(Run { context: context as u32, first, last });
            }
            first = last;
        }
    }
}

fn for_each_in_turn(count: usize, mut visit: impl FnMut(usize, usize)) {
    let length = count / LANES + 1;
    for step in 0..length {
        for lane in 0..LANES {
            let element = lane * length + step;
            if element < count {
                visit(lane, element);
            }
        }
    }
}

//! The elements of a plane sorted by context, as SPEC 8.1 requires.

/// Adjacent elements of one context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Context within the model of the plane.
    pub context: u32,
    /// Index of the first element.
    pub first: u32,
    /// Index past the last element; above `first`.
    pub last: u32,
}

impl Run {
    /// The index range of its elements.
    #[must_use]
    pub const fn range(self) -> std::ops::Range<usize> {
        self.first as usize..self.last as usize
    }
}

/// The sorted elements of a plane. The buffers can be reused.
#[derive(Clone, Debug, Default)]
pub struct Sorted {
    /// The elements sorted by context; the sort is stable.
    pub order: Vec<u32>,
    /// The runs of equal contexts, ascending; none is empty.
    pub runs: Vec<Run>,
    places: Vec<[u32; LANES]>,
}

/// Number of interleaved positions that are processed in turn, far apart, so that no iteration
/// waits for what the previous one has written.
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

    /// Convert the number of elements per context to the position of its next element.
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

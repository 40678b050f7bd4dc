/// Lines along one side of a tile.
pub(crate) const SIDE: usize = 32;
/// Lines of a tile.
pub(crate) const LINES: usize = SIDE * SIDE;

/// Length that is too little to be taken out of an interval, mm: surfaces that are cut again along
/// the same solid differ by rounding. Smaller, every repeated cut would take dust off; larger, cuts
/// would be less than exact.
pub(crate) const DUST: f64 = 1e-9;

/// One interval of material, both ends included, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub bottom: f64,
    /// Upper end, above the lower one.
    pub top: f64,
}

/// An interval above the lowest one of its line.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Further {
    line: u16,
    interval: Interval,
}

/// A square of 32 × 32 lines. The lowest interval of each is stored in place, the others in one
/// list for the tile.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tile {
    /// Lowest interval of each line; of an empty line bottom +∞ and top −∞.
    bottom: Box<[f64]>,
    top: Box<[f64]>,
    /// Further intervals by line, then upward.
    further: Vec<Further>,
    /// Lines that have further intervals, a bit each, row by row.
    has_further: [u32; SIDE],
    /// Lowest bottom and highest top of each row.
    row_low: [f64; SIDE],
    row_high: [f64; SIDE],
    /// The same of the tile.
    low: f64,
    high: f64,
}

impl Tile {
    pub(crate) fn empty() -> Self {
        Self {
            bottom: vec![f64::INFINITY; LINES].into(),
            top: vec![f64::NEG_INFINITY; LINES].into(),
            further: Vec::new(),
            has_further: [0; SIDE],
            row_low: [f64::INFINITY; SIDE],
            row_high: [f64::NEG_INFINITY; SIDE],
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        }
    }

    /// Lowest bottom and highest top.
    pub(crate) fn bounds(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// Lowest bottom and highest top of a row.
    pub(crate) fn row_bounds(&self, row: usize) -> [f64; 2] {
        [self.row_low[row], self.row_high[row]]
    }

    /// Highest top of a line.
    pub(crate) fn top_of(&self, line: usize) -> f64 {
        if self.has_more(line) {
            self.intervals(line).last().map_or(f64::NEG_INFINITY, |i| i.top)
        } else {
            self.top[line]
        }
    }

    /// Highest tops of the lines of a row without further intervals, of others those of the lowest.
    pub(crate) fn lowest_tops(&self, row: usize) -> &[f64] {
        &self.top[row * SIDE..(row + 1) * SIDE]
    }

    /// Whether lines of a row have further intervals.
    pub(crate) fn is_row_plain(&self, row: usize) -> bool {
        self.has_further[row] == 0
    }

    #[inline(always)]
    pub(crate) fn has_more(&self, line: usize) -> bool {
        self.has_further[line / SIDE] & (1 << (line % SIDE)) != 0
    }

    fn further_of(&self, line: usize) -> std::ops::Range<usize> {
        if !self.has_more(line) {
            return 0..0;
        }
        let of = line as u16;
        self.further.partition_point(|f| f.line < of)..self.further.partition_point(|f| f.line <= of)
    }

    /// The intervals of a line, upward.
    pub(crate) fn intervals(&self, line: usize) -> impl Iterator<Item = Interval> + '_ {
        let first = Interval { bottom: self.bottom[line], top: self.top[line] };
        let further = self.further[self.further_of(line)].iter().map(|f| f.interval);
        (first.bottom < first.top).then_some(first).into_iter().chain(further)
    }

    /// Replaces a line. The bounds of its row are stale until [`Tile::refresh_row`].
    pub(crate) fn set(&mut self, line: usize, intervals: &[Interval]) {
        let first = intervals.first().copied();
        let first = first.unwrap_or(Interval { bottom: f64::INFINITY, top: f64::NEG_INFINITY });
        (self.bottom[line], self.top[line]) = (first.bottom, first.top);
        let rest = intervals.get(1..).unwrap_or(&[]);
        let old = self.further_of(line);
        if old.is_empty() && rest.is_empty() {
            return;
        }
        let of = line as u16;
        let place = if old.is_empty() {
            let at = self.further.partition_point(|f| f.line < of);
            at..at
        } else {
            old
        };
        self.further.splice(place, rest.iter().map(|&interval| Further { line: of, interval }));
        let bit = 1 << (line % SIDE);
        let bits = &mut self.has_further[line / SIDE];
        *bits = if rest.is_empty() { *bits & !bit } else { *bits | bit };
    }

    /// Takes what is strictly between two heights out of a line, unless it is [`DUST`]; returns the
    /// length removed, mm.
    pub(crate) fn subtract(&mut self, line: usize, from: f64, to: f64) -> f64 {
        if self.has_more(line) {
            return self.subtract_from_many(line, from, to);
        }
        let (bottom, top) = (self.bottom[line], self.top[line]);
        let (low, high) = (from.max(bottom), to.min(top));
        if high - low <= DUST || low.is_nan() || high.is_nan() {
            return 0.0;
        }
        match (bottom < low, high < top) {
            (false, false) => self.set(line, &[]),
            (true, false) => self.top[line] = low,
            (false, true) => self.bottom[line] = high,
            (true, true) => self.set(line, &[Interval { bottom, top: low }, Interval { bottom: high, top }]),
        }
        high - low
    }

    /// Takes all above a height out of a line: [`Tile::subtract`] without an upper end.
    #[inline(always)]
    pub(crate) fn cut_down(&mut self, line: usize, from: f64) -> f64 {
        let (bottom, top) = (self.bottom[line], self.top[line]);
        if self.has_more(line) || from <= bottom {
            return self.subtract(line, from, f64::INFINITY);
        }
        let length = top - from;
        if length <= DUST || length.is_nan() {
            return 0.0;
        }
        self.top[line] = from;
        length
    }

    fn subtract_from_many(&mut self, line: usize, from: f64, to: f64) -> f64 {
        let mut removed = 0.0;
        let mut left = Vec::with_capacity(8);
        for Interval { bottom, top } in self.intervals(line) {
            let (low, high) = (from.max(bottom), to.min(top));
            if high - low > DUST {
                removed += high - low;
                let parts = [Interval { bottom, top: low }, Interval { bottom: high, top }];
                left.extend(parts.into_iter().filter(|i| i.bottom < i.top));
            } else {
                left.push(Interval { bottom, top });
            }
        }
        if removed > 0.0 {
            self.set(line, &left);
        }
        removed
    }

    /// Brings the bounds of a row up to date with its lines.
    pub(crate) fn refresh_row(&mut self, row: usize) {
        let lines = row * SIDE..(row + 1) * SIDE;
        let low = self.bottom[lines.clone()].iter().fold(f64::INFINITY, |m, &v| if v < m { v } else { m });
        let mut high = self.top[lines.clone()].iter().fold(f64::NEG_INFINITY, |m, &v| if v > m { v } else { m });
        if self.has_further[row] != 0 {
            high = lines.map(|line| self.top_of(line)).fold(high, f64::max);
        }
        (self.row_low[row], self.row_high[row]) = (low, high);
    }

    /// Brings the bounds of the tile up to date with those of its rows.
    pub(crate) fn refresh(&mut self) {
        self.low = self.row_low.iter().copied().fold(f64::INFINITY, f64::min);
        self.high = self.row_high.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    }

    /// Length of all intervals, mm, summed line by line.
    pub(crate) fn length(&self) -> f64 {
        (0..LINES).map(|line| self.intervals(line).map(|i| i.top - i.bottom).sum::<f64>()).sum()
    }

    /// Returns the fault of the tile, if it has one: its line, and the fault.
    pub(crate) fn fault(&self) -> Option<(usize, String)> {
        let mut n_further = 0;
        for line in 0..LINES {
            let more = self.further_of(line);
            n_further += more.len();
            let (bottom, top) = (self.bottom[line], self.top[line]);
            let is_empty = bottom == f64::INFINITY && top == f64::NEG_INFINITY;
            if self.has_more(line) == more.is_empty() || (is_empty && !more.is_empty()) {
                return Some((line, "its list of further intervals does not fit".into()));
            }
            let mut last = f64::NEG_INFINITY;
            for Interval { bottom, top } in self.intervals(line) {
                if !(bottom.is_finite() && top.is_finite() && bottom < top && last < bottom) {
                    return Some((line, format!("interval [{bottom}, {top}] after {last} is empty or out of order")));
                }
                last = top;
            }
            if !is_empty && last == f64::NEG_INFINITY {
                return Some((line, format!("interval [{bottom}, {top}] is empty")));
            }
        }
        if n_further != self.further.len() {
            return Some((0, "the tile's list of further intervals is out of order".into()));
        }
        let mut fresh = self.clone();
        (0..SIDE).for_each(|row| fresh.refresh_row(row));
        fresh.refresh();
        (fresh != *self).then(|| (0, "the tile's bounds are not those of its lines".into()))
    }
}

//! Which samples were taken.

use resolvent_pathspace::nets;
use std::ops::Range;

/// A set of samples: ranges in order that neither overlap nor touch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage(Vec<Range<u32>>);

impl Coverage {
    /// The ranges.
    pub fn ranges(&self) -> &[Range<u32>] {
        &self.0
    }

    /// Number of samples.
    pub fn samples(&self) -> u32 {
        self.0.iter().map(|r| r.end - r.start).sum()
    }

    /// Number of nets that have some of the samples.
    pub fn nets(&self) -> u32 {
        let mut count = 0;
        let mut next = 0;
        for r in &self.0 {
            let (first, last) = (nets::number(r.start), nets::number(r.end - 1));
            count += last + 1 - first.max(next);
            next = last + 1;
        }
        count
    }

    /// Adds a range.
    ///
    /// # Errors
    /// The first of its samples that are there already.
    pub fn insert(&mut self, new: Range<u32>) -> Result<(), Range<u32>> {
        if new.is_empty() {
            return Ok(());
        }
        let at = self.0.partition_point(|r| r.end < new.start);
        // From `at` on: what touches or overlaps comes first.
        let touching = self.0[at..].iter().take_while(|r| r.start <= new.end);
        for r in touching.clone() {
            let both = r.start.max(new.start)..r.end.min(new.end);
            if !both.is_empty() {
                return Err(both);
            }
        }
        let count = touching.count();
        let joined = self.0[at..at + count]
            .iter()
            .fold(new, |a, r| a.start.min(r.start)..a.end.max(r.end));
        self.0.splice(at..at + count, [joined]);
        Ok(())
    }

    /// Adds a range after all others, which it must not touch; false if it is not one.
    pub fn push(&mut self, new: Range<u32>) -> bool {
        let good = !new.is_empty() && self.0.last().is_none_or(|last| last.end < new.start);
        if good {
            self.0.push(new);
        }
        good
    }

    /// Adds all samples of another.
    ///
    /// # Errors
    /// The first of its samples that are there already; then nothing is changed.
    pub fn join(&mut self, other: &Self) -> Result<(), Range<u32>> {
        let mut all = [&self.0[..], &other.0[..]].concat();
        all.sort_by_key(|r| r.start);
        let mut joined: Vec<Range<u32>> = Vec::with_capacity(all.len());
        for r in all {
            match joined.last_mut() {
                Some(last) if r.start < last.end => return Err(r.start..r.end.min(last.end)),
                Some(last) if r.start == last.end => last.end = r.end,
                _ => joined.push(r),
            }
        }
        self.0 = joined;
        Ok(())
    }

    /// What of `wanted` is not there.
    pub fn missing(&self, wanted: Range<u32>) -> Vec<Range<u32>> {
        let mut out = Vec::new();
        let mut begin = wanted.start;
        let first = self.0.partition_point(|r| r.end <= wanted.start);
        for r in &self.0[first..] {
            if r.start >= wanted.end {
                break;
            }
            if r.start > begin {
                out.push(begin..r.start);
            }
            begin = begin.max(r.end);
        }
        if begin < wanted.end {
            out.push(begin..wanted.end);
        }
        out
    }

    /// The first samples that are there but not in `wanted`.
    pub fn beyond(&self, wanted: &Range<u32>) -> Option<Range<u32>> {
        self.0.iter().find_map(|r| {
            if r.start < wanted.start {
                Some(r.start..r.end.min(wanted.start))
            } else if r.end > wanted.end {
                Some(r.start.max(wanted.end)..r.end)
            } else {
                None
            }
        })
    }
}

impl std::fmt::Display for Coverage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, r) in self.0.iter().enumerate() {
            let comma = if i > 0 { "," } else { "" };
            write!(f, "{comma}{}..{}", r.start, r.end)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::rng::Stream;

    /// Against a list of flags, with random ranges.
    #[test]
    fn is_the_set_it_says() {
        const END: u32 = 400;
        let mut s = Stream::new(4);
        for _ in 0..300 {
            let (mut c, mut flags) = (Coverage::default(), [false; END as usize]);
            for _ in 0..12 {
                let begin = (s.uniform() * 380.0) as u32;
                let r = begin..(begin + (s.uniform().powi(2) * 60.0) as u32).min(END);
                let slice = &mut flags[r.start as usize..r.end as usize];
                match c.insert(r.clone()) {
                    Ok(()) => {
                        assert!(slice.iter().all(|f| !f));
                        slice.fill(true);
                    }
                    Err(both) => {
                        assert!(r.start <= both.start && both.end <= r.end && !both.is_empty());
                        assert!(
                            flags[both.start as usize..both.end as usize]
                                .iter()
                                .all(|f| *f)
                        );
                    }
                }
            }
            assert_eq!(c.samples() as usize, flags.iter().filter(|f| **f).count());
            let wanted = 37..311;
            let mut missing = vec![false; END as usize];
            for r in c.missing(wanted.clone()) {
                missing[r.start as usize..r.end as usize].fill(true);
            }
            let mut nets_of = std::collections::BTreeSet::new();
            for i in 0..END {
                let here = flags[i as usize];
                assert_eq!(missing[i as usize], !here && wanted.contains(&i));
                if here {
                    nets_of.insert(nets::number(i));
                }
            }
            assert_eq!(c.nets() as usize, nets_of.len());
            let outside = (0..END).find(|i| flags[*i as usize] && !wanted.contains(i));
            assert_eq!(c.beyond(&wanted).map(|r| r.start), outside);
            assert!(c.0.windows(2).all(|w| w[0].end < w[1].start));
        }
    }

    /// Joining is adding range by range.
    #[test]
    fn sets_join() {
        let mut s = Stream::new(8);
        let (mut joined, mut refused) = (0, 0);
        for _ in 0..2000 {
            let mut set = || {
                let mut c = Coverage::default();
                for _ in 0..3 {
                    let begin = (s.uniform() * 100.0) as u32;
                    let _ = c.insert(begin..begin + (s.uniform() * 20.0) as u32);
                }
                c
            };
            let (a, b) = (set(), set());
            let (mut there, mut back) = (a.clone(), a.clone());
            match there.join(&b) {
                Ok(()) => {
                    b.0.iter().for_each(|r| back.insert(r.clone()).unwrap());
                    assert_eq!(there, back);
                    joined += 1;
                }
                Err(both) => {
                    assert_eq!(there, a);
                    let has = |c: &Coverage| c.missing(both.clone()).is_empty();
                    assert!(!both.is_empty() && has(&a) && has(&b));
                    refused += 1;
                }
            }
        }
        assert!(joined > 200 && refused > 200, "{joined} {refused}");
    }

    #[test]
    fn only_what_follows_is_pushed() {
        let mut c = Coverage::default();
        assert!(c.push(3..5) && c.push(6..9));
        for wrong in [9..10, 8..12, 0..1, 20..20] {
            assert!(!c.push(wrong));
        }
        assert_eq!(c.0, [3..5, 6..9]);
    }
}

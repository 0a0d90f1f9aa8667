//! What fills closed shapes, and which of it fills the places where they overlap: nested dielectrics with priorities.
//!
//! A set says in which bodies a point is: for every interior a small counter, packed into 64 bits. Shapes that are filled alike (the
//! same medium, index of refraction and priority) count as one body, so that its boundary may consist of several shapes, and copies of
//! it may overlap. Of the interiors that a point is in, those of the highest priority fill it: their media superpose, their index of
//! refraction holds, and all others are displaced. A surface of a body at a point that another of higher priority fills is not there:
//! rays pass it, and only the set changes (Schmidt and Budge 2002, "Simple Nested Dielectrics in Ray Traced Images").
//!
//! Counters are sorted, so that what fills a point is found by the lowest bit.

use super::Surface;

/// Points are in a set of at most so many interiors.
const MAX_INTERIORS: usize = 64;

/// What is inside a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Interior {
    /// Index of its medium, if it has one.
    pub medium: Option<u32>,
    /// Index of refraction.
    pub ior: f32,
    /// The higher displaces the lower.
    pub priority: i32,
}

/// All interiors of a scene, those of high priority first, and of equal ones those first that differ most from vacuum: an
/// index-matched medium says nothing about the index.
#[derive(Default)]
pub(crate) struct Interiors {
    all: Vec<Interior>,
    /// For each, the counters of its priority.
    equal: Vec<u64>,
    /// Bits of a counter.
    width: u32,
    /// Some refract, or their priorities differ: otherwise all media superpose in vacuum, and no set needs to be looked at.
    nest: bool,
}

/// Interiors while surfaces are collected; [`Surface::interior`] is an index in here until [`Collected::sort`].
#[derive(Default)]
pub(super) struct Collected(Vec<Interior>);

impl Collected {
    pub fn add(&mut self, interior: Interior) -> u32 {
        self.0.push(interior);
        self.0.len() as u32 - 1
    }

    /// Gives every interior a counter, as wide as there is room: with up to 8 of them 255 copies of a body may overlap, with more than 32
    /// only one. `surfaces` then refer to those and know what hides them.
    ///
    /// # Errors
    /// How many different ones there are, if they are too many.
    pub fn sort<'s>(
        self,
        surfaces: impl Iterator<Item = &'s mut Surface>,
    ) -> Result<Interiors, usize> {
        let mut all: Vec<Interior> = Vec::new();
        for interior in &self.0 {
            if !all.contains(interior) {
                all.push(*interior);
            }
        }
        if all.len() > MAX_INTERIORS {
            return Err(all.len());
        }
        let distance = |i: &Interior| i.ior.ln().abs();
        all.sort_by(|a, b| {
            let by_priority = b.priority.cmp(&a.priority);
            by_priority.then(distance(b).total_cmp(&distance(a)))
        });
        let width = match all.len() {
            0..=8 => 8,
            9..=16 => 4,
            17..=32 => 2,
            _ => 1,
        };
        let mut interiors = Interiors {
            nest: all
                .iter()
                .any(|i| i.ior != 1.0 || i.priority != all[0].priority),
            equal: Vec::new(),
            width,
            all,
        };
        let all = &interiors.all;
        interiors.equal = all
            .iter()
            .map(|a| interiors.those(|b| b.priority == a.priority))
            .collect();
        for surface in surfaces {
            let Some(interior) = surface.interior else {
                continue;
            };
            let own = self.0[interior as usize];
            surface.interior = interiors
                .all
                .iter()
                .position(|i| *i == own)
                .map(|i| i as u32);
            // Lights are met wherever they are, since connections lead to them.
            if surface.light.is_none() {
                surface.hidden_by = interiors.those(|b| b.priority > own.priority);
                if own.ior != 1.0 {
                    surface.body = interiors.those(|b| *b == own);
                }
            }
        }
        Ok(interiors)
    }
}

impl Interiors {
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The counters of some.
    fn those(&self, wanted: impl Fn(&Interior) -> bool) -> u64 {
        let counter = u64::MAX >> (64 - self.width);
        let wanted = self.all.iter().enumerate().filter(|(_, i)| wanted(i));
        wanted.fold(0, |set, (k, _)| set | counter << (self.width * k as u32))
    }

    /// The counters of those that a medium fills.
    pub fn filled_by(&self, medium: u32) -> u64 {
        self.those(|i| i.medium == Some(medium))
    }

    /// The counter of one of them.
    #[inline(always)]
    fn counter(&self, interior: u32) -> u64 {
        (u64::MAX >> (64 - self.width)) << (self.width * interior)
    }

    /// A set without one of them.
    #[inline(always)]
    pub fn without(&self, interior: u32, inside: u64) -> u64 {
        inside & !self.counter(interior)
    }

    /// The set behind a boundary of one of them.
    #[inline(always)]
    pub fn entered(&self, interior: u32, inside: u64) -> u64 {
        let counter = self.counter(interior);
        if inside & counter == counter {
            return inside;
        }
        inside + (1 << (self.width * interior))
    }

    /// The set before a boundary of one of them.
    #[inline(always)]
    pub fn left(&self, interior: u32, inside: u64) -> u64 {
        if inside & self.counter(interior) == 0 {
            return inside;
        }
        inside - (1 << (self.width * interior))
    }

    /// True if a set has one of them.
    pub fn has(&self, interior: u32, inside: u64) -> bool {
        inside & self.counter(interior) != 0
    }

    /// Those of a set which are not displaced by others.
    #[inline(always)]
    pub fn filling(&self, inside: u64) -> u64 {
        if !self.nest || inside == 0 {
            return inside;
        }
        inside & self.equal[(inside.trailing_zeros() / self.width) as usize]
    }

    /// Index of refraction in a set.
    #[inline(always)]
    pub fn ior(&self, inside: u64) -> f32 {
        if !self.nest || inside == 0 {
            return 1.0;
        }
        self.all[(inside.trailing_zeros() / self.width) as usize].ior
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interior(medium: Option<u32>, ior: f32, priority: i32) -> Interior {
        Interior {
            medium,
            ior,
            priority,
        }
    }

    fn collect(all: &[Interior]) -> (Result<Interiors, usize>, Vec<Surface>) {
        let mut collected = Collected::default();
        let surface = |i: &Interior| Surface {
            interior: Some(collected.add(*i)),
            ..Surface::default()
        };
        let mut surfaces: Vec<Surface> = all.iter().map(surface).collect();
        let interiors = collected.sort(surfaces.iter_mut());
        (interiors, surfaces)
    }

    #[test]
    fn a_glass_of_milk_with_ice() {
        let (milk, glass, ice, fog) = (0, 1, 2, 3);
        let (all, surfaces) = collect(&[
            interior(Some(0), 1.35, 1),
            interior(None, 1.5, 2),
            interior(None, 1.31, 3),
            interior(Some(1), 1.0, 0),
        ]);
        let all = all.unwrap();
        let own = |i: usize| surfaces[i].interior.unwrap();
        let set = |of: &[usize]| of.iter().fold(0, |s, i| all.entered(own(*i), s));
        // On the way in.
        let hidden = |i: usize, inside: u64| surfaces[i].passes(inside, false);
        // The milk's surface within the glass is not there, nor is the glass's within the ice.
        assert!(hidden(milk, set(&[glass])) && !hidden(glass, set(&[milk])));
        assert!(hidden(glass, set(&[ice])) && !hidden(ice, set(&[glass, milk])));
        assert!(!hidden(milk, set(&[fog])) && hidden(fog, set(&[milk])));
        assert_eq!(all.filling(set(&[milk, glass, fog])), set(&[glass]));
        assert_eq!(all.filling(set(&[milk, fog])), set(&[milk]));
        assert_eq!(all.filling(set(&[fog])), set(&[fog]));
        assert_eq!(all.ior(set(&[milk, glass])), 1.5);
        assert_eq!(all.ior(set(&[milk, fog])), 1.35);
        assert_eq!((all.ior(set(&[fog])), all.ior(0)), (1.0, 1.0));
        assert!(all.filled_by(0) & set(&[milk]) != 0 && all.filled_by(0) & set(&[fog]) == 0);
    }

    #[test]
    fn media_of_equal_priority_superpose() {
        let (all, surfaces) = collect(&[interior(Some(0), 1.0, 0), interior(Some(1), 1.0, 0)]);
        let all = all.unwrap();
        let both = all.entered(1, all.entered(0, 0));
        assert_eq!(
            (all.filling(both), all.ior(both), all.nest),
            (both, 1.0, false)
        );
        assert!(surfaces.iter().all(|s| s.hidden_by == 0 && s.body == 0));
        // In foggy water, the index is the water's.
        let (all, surfaces) = collect(&[interior(Some(0), 1.0, 0), interior(None, 1.33, 0)]);
        let all = all.unwrap();
        assert_eq!((all.filling(both), all.ior(both)), (both, 1.33));
        assert!(surfaces.iter().all(|s| s.hidden_by == 0));
    }

    /// Pieces of ice that overlap: the surface of the one within the other is not there, on the way in and on the way out.
    #[test]
    fn copies_of_a_body_are_one() {
        let (all, surfaces) = collect(&[interior(None, 1.31, 1); 2]);
        let (all, ice) = (all.unwrap(), surfaces[1]);
        assert_eq!(all.all.len(), 1);
        let one = all.entered(0, 0);
        let two = all.entered(0, one);
        assert!(!ice.passes(0, false) && ice.passes(one, false));
        assert!(ice.passes(two, true) && !ice.passes(one, true));
        assert_eq!(
            (all.left(0, two), all.left(0, one), all.left(0, 0)),
            (one, 0, 0)
        );
        assert_eq!((all.ior(two), all.without(0, two)), (1.31, 0));
    }

    #[test]
    fn counters_do_not_run_over() {
        for count in [1, 8, 9, 20, 33, 64] {
            let many: Vec<Interior> = (0..count).map(|i| interior(Some(i), 1.0, 0)).collect();
            let all = collect(&many).0.unwrap();
            let mut inside = 0;
            for _ in 0..300 {
                inside = all.entered(count - 1, inside);
            }
            assert_eq!(inside, all.filled_by(count - 1));
            for _ in 0..300 {
                inside = all.left(count - 1, inside);
            }
            assert_eq!(inside, 0);
        }
        let many: Vec<Interior> = (0..65).map(|i| interior(Some(i), 1.0, 0)).collect();
        assert_eq!(collect(&many).0.err(), Some(65));
    }
}

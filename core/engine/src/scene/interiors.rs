//! What fills closed shapes, and which of it fills the places where they overlap: nested dielectrics with priorities.
//!
//! A point is inside a set of shapes, kept as bits. Of these the ones of the highest priority fill the point: their media superpose,
//! their index of refraction holds; all others are displaced. A surface of a shape at a point that one of higher priority fills is
//! not there: rays pass it, and only the set changes (Schmidt and Budge 2002, "Simple Nested Dielectrics in Ray Traced Images").
//!
//! Bits are sorted, so that what fills a point is found by its lowest bit.

use super::Surface;

/// Points are in a set of at most so many interiors.
const MAX_INTERIORS: usize = 64;

/// What is inside a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Interior {
    /// Index of its medium, if it has one.
    pub medium: Option<u32>,
    /// Index of the material of its surface.
    pub material: Option<u32>,
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
    /// For each, those of its priority.
    equal: Vec<u64>,
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

    /// Gives every shape a bit of its own, or if they are too many, all that are filled alike one together. (Where two of these
    /// overlap, leaving one counts as leaving both.) `surfaces` then refer to those bits and know what hides them.
    ///
    /// # Errors
    /// How many different ones there are, if they are too many.
    pub fn sort<'s>(
        self,
        surfaces: impl Iterator<Item = &'s mut Surface>,
    ) -> Result<Interiors, usize> {
        // (the interior, where it was collected)
        let mut order: Vec<(Interior, Vec<u32>)> = Vec::new();
        let apart = self.0.len() <= MAX_INTERIORS;
        for (i, interior) in (0..).zip(self.0) {
            match order.iter_mut().find(|(o, _)| !apart && *o == interior) {
                Some((_, members)) => members.push(i),
                None => order.push((interior, vec![i])),
            }
        }
        if order.len() > MAX_INTERIORS {
            return Err(order.len());
        }
        let distance = |i: &Interior| i.ior.ln().abs();
        order.sort_by(|(a, _), (b, _)| {
            let by_priority = b.priority.cmp(&a.priority);
            by_priority.then(distance(b).total_cmp(&distance(a)))
        });
        let all: Vec<Interior> = order.iter().map(|(i, _)| *i).collect();
        let those = |f: &dyn Fn(&Interior) -> bool| {
            let bits = all.iter().enumerate().filter(|(_, i)| f(i));
            bits.fold(0u64, |set, (k, _)| set | 1 << k)
        };
        let equal = all
            .iter()
            .map(|a| those(&|b| b.priority == a.priority))
            .collect();
        let mut bit_of = vec![0; order.iter().map(|(_, m)| m.len()).sum()];
        for (bit, (_, members)) in (0..).zip(&order) {
            for &m in members {
                bit_of[m as usize] = bit;
            }
        }
        for surface in surfaces {
            let Some(interior) = &mut surface.interior else {
                continue;
            };
            *interior = bit_of[*interior as usize];
            if surface.light.is_some() {
                // Lights are met wherever they are, since connections lead to them.
                continue;
            }
            let own = all[*interior as usize];
            // Where two equal dielectrics overlap they are one body.
            let one_body = own.ior != 1.0;
            let hides = |b: &Interior| b.priority > own.priority || (one_body && *b == own);
            surface.hidden_by = those(&hides) & !(1 << *interior);
        }
        let nest = all
            .iter()
            .any(|i| i.ior != 1.0 || i.priority != all[0].priority);
        Ok(Interiors { all, equal, nest })
    }
}

impl Interiors {
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Those that a medium fills.
    pub fn filled_by(&self, medium: u32) -> u64 {
        let bits = self.all.iter().enumerate();
        bits.filter(|(_, i)| i.medium == Some(medium))
            .fold(0, |set, (k, _)| set | 1 << k)
    }

    /// Those of a set which are not displaced by others.
    #[inline(always)]
    pub fn filling(&self, inside: u64) -> u64 {
        if !self.nest || inside == 0 {
            return inside;
        }
        inside & self.equal[inside.trailing_zeros() as usize]
    }

    /// Index of refraction in a set.
    #[inline(always)]
    pub fn ior(&self, inside: u64) -> f32 {
        if !self.nest || inside == 0 {
            return 1.0;
        }
        self.all[inside.trailing_zeros() as usize].ior
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interior(medium: Option<u32>, ior: f32, priority: i32) -> Interior {
        Interior {
            medium,
            material: Some(0),
            ior,
            priority,
        }
    }

    fn surface(interior: u32) -> Surface {
        Surface {
            material: Some(0),
            light: None,
            interior: Some(interior),
            null: false,
            hidden_by: 0,
        }
    }

    fn collect(all: &[Interior]) -> (Result<Interiors, usize>, Vec<Surface>) {
        let mut collected = Collected::default();
        let mut surfaces: Vec<Surface> = all.iter().map(|i| surface(collected.add(*i))).collect();
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
        let bit = |i: usize| 1u64 << surfaces[i].interior.unwrap();
        let set = |of: &[usize]| of.iter().fold(0, |s, i| s | bit(*i));
        let hidden = |i: usize, inside: u64| surfaces[i].hidden_by & inside != 0;
        // The milk's surface within the glass is not there, nor is the glass's within the ice.
        assert!(hidden(milk, set(&[glass, milk])) && !hidden(glass, set(&[glass, milk])));
        assert!(hidden(glass, set(&[ice])) && !hidden(ice, set(&[glass, milk])));
        assert!(!hidden(milk, set(&[milk, fog])) && hidden(fog, set(&[milk])));
        assert_eq!(all.filling(set(&[milk, glass, fog])), bit(glass));
        assert_eq!(all.filling(set(&[milk, fog])), bit(milk));
        assert_eq!(all.filling(set(&[fog])), bit(fog));
        assert_eq!(all.ior(set(&[milk, glass])), 1.5);
        assert_eq!(all.ior(set(&[milk, fog])), 1.35);
        assert_eq!((all.ior(set(&[fog])), all.ior(0)), (1.0, 1.0));
        assert_eq!((all.filled_by(0), all.filled_by(1)), (bit(milk), bit(fog)));
    }

    #[test]
    fn media_of_equal_priority_superpose() {
        let (all, surfaces) = collect(&[interior(Some(0), 1.0, 0), interior(Some(1), 1.0, 0)]);
        let all = all.unwrap();
        assert_eq!((all.filling(3), all.ior(3), all.nest), (3, 1.0, false));
        assert!(surfaces.iter().all(|s| s.hidden_by == 0));
        // In foggy water, the index is the water's.
        let (all, surfaces) = collect(&[interior(Some(0), 1.0, 0), interior(None, 1.33, 0)]);
        let all = all.unwrap();
        assert_eq!((all.filling(3), all.ior(3)), (3, 1.33));
        assert!(surfaces.iter().all(|s| s.hidden_by == 0));
    }

    #[test]
    fn equal_bodies_are_one() {
        let (all, surfaces) = collect(&[interior(None, 1.31, 1); 2]);
        assert_eq!((surfaces[0].hidden_by, surfaces[1].hidden_by), (2, 1));
        assert_eq!(all.unwrap().filling(3), 3);
    }

    #[test]
    fn too_many() {
        let many: Vec<Interior> = (0..100).map(|i| interior(Some(i % 64), 1.0, 0)).collect();
        let (all, surfaces) = collect(&many);
        assert_eq!(all.unwrap().all.len(), 64);
        assert_eq!(surfaces[3].interior, surfaces[67].interior);
        let many: Vec<Interior> = (0..100).map(|i| interior(Some(i), 1.0, 0)).collect();
        assert_eq!(collect(&many).0.err(), Some(100));
    }
}

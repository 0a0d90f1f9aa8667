//! What the geometry tests share.
#![allow(dead_code)] // Each test file uses its part.

use std::collections::HashMap;
use std::f32::consts::TAU;

use glam::{Vec3, vec3};
use resolvent_engine::geometry::TriangleMesh;

/// Numbers in [0, 1) from a hashed counter (SplitMix64).
pub struct Uniform(pub u64);

impl Uniform {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn next(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / 16_777_216.0
    }

    /// In (−1, 1).
    pub fn signed(&mut self) -> f32 {
        2.0 * self.next() - 1.0
    }

    pub fn vector(&mut self) -> Vec3 {
        vec3(self.signed(), self.signed(), self.signed())
    }

    pub fn direction(&mut self) -> Vec3 {
        let z = self.signed();
        let (s, c) = (TAU * self.next()).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        vec3(r * c, r * s, z)
    }
}

/// `full` in release builds, a tenth of it in debug builds.
pub fn rays_in_test(full: usize) -> usize {
    if cfg!(debug_assertions) {
        full / 10
    } else {
        full
    }
}

/// `full` with `RESOLVENT_FULL=1` in the environment, else `part`; a tenth of that in debug builds.
pub fn share_of(full: usize, part: usize) -> usize {
    let all = std::env::var_os("RESOLVENT_FULL").is_some_and(|v| v == "1");
    rays_in_test(if all { full } else { part })
}

/// Unit icosahedron with every triangle split in four `levels` times: 20·4^levels triangles, wound outwards.
pub fn icosphere(levels: u32) -> TriangleMesh {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let mut positions = Vec::new();
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        positions.push(vec3(a, b, 0.0).normalize());
    }
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        positions.push(vec3(0.0, a, b).normalize());
    }
    for (a, b) in [(g, -1.0), (g, 1.0), (-g, -1.0), (-g, 1.0)] {
        positions.push(vec3(a, 0.0, b).normalize());
    }
    let mut indices: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut split = Vec::with_capacity(4 * indices.len());
        for [a, b, c] in indices {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
            split.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
        }
        indices = split;
    }
    TriangleMesh {
        positions,
        indices,
        ..TriangleMesh::default()
    }
}

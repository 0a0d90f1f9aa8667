//! Slab and triangle kernels in plain Rust: the reference for [`super::simd`], lane by lane the same operations in the same
//! order, so that both give the same bits.

use super::bvh8::{Child, Node8};
use super::ray::RaySetup;
use super::traverse::Tree;
use super::triangle::{LANES, Packet, PacketHits, TINY_DET, decide_lane, gamma};

/// Entry distances of the eight children of a node.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct Near(pub [f32; 8]);

/// The two tests a traversal is made of.
pub(super) trait Kernel: Copy {
    /// Mask of children whose boxes the ray may meet in \[t_min, `t_max`\], and their entry distances.
    fn node(self, ray: &RaySetup, node: &Node8, t_max: f32) -> (u32, Near);

    /// Starts loading what `child` leads to. A hint only.
    fn prefetch(self, tree: &Tree, child: Child);

    /// Mask of triangles hit in (t_min, `t_max`\], with t and barycentrics in `hits`, of one or two packets (more are ignored).
    /// t and barycentrics depend on ray and triangle alone, not on `t_max`, which shrinks during a traversal.
    fn packets(self, ray: &RaySetup, packets: &[Packet], t_max: f32, hits: &mut PacketHits) -> u32;
}

/// Works on every processor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

/// maxps: the second operand if either is NaN.
#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// minps: the second operand if either is NaN.
#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Mask of the lanes where `f` holds.
#[inline(always)]
fn mask<const N: usize>(f: impl Fn(usize) -> bool) -> u32 {
    (0..N).fold(0, |m, i| m | u32::from(f(i)) << i)
}

impl Kernel for Portable {
    #[inline(always)]
    fn prefetch(self, _: &Tree, _: Child) {}

    #[inline(always)]
    fn node(self, ray: &RaySetup, node: &Node8, t_max: f32) -> (u32, Near) {
        let mut near = [ray.t_min; 8];
        let mut far = [t_max; 8];
        for axis in 0..3 {
            let row = ray.near_row[axis];
            for i in 0..8 {
                near[i] = max(
                    (node.bounds[row][i] - ray.o[axis]) * ray.inv_near[axis],
                    near[i],
                );
                far[i] = min(
                    (node.bounds[row ^ 1][i] - ray.o[axis]) * ray.inv_far[axis],
                    far[i],
                );
            }
        }
        (mask::<8>(|i| near[i] <= far[i]), Near(near))
    }

    #[inline(always)]
    fn packets(self, ray: &RaySetup, packets: &[Packet], t_max: f32, hits: &mut PacketHits) -> u32 {
        let test = |(i, packet)| self.packet(ray, packet, LANES * i, t_max, hits) << (LANES * i);
        packets.iter().take(2).enumerate().map(test).sum()
    }
}

impl Portable {
    /// One packet, whose hits start at lane `at`.
    #[inline(always)]
    fn packet(
        self,
        ray: &RaySetup,
        packet: &Packet,
        at: usize,
        t_max: f32,
        hits: &mut PacketHits,
    ) -> u32 {
        let [kx, ky, kz] = ray.k;
        let mut p = [[[0.0f32; LANES]; 3]; 3];
        for (out, v) in p.iter_mut().zip(&packet.v) {
            for i in 0..LANES {
                let z = v[kz][i] - ray.o[kz];
                out[0][i] = (v[kx][i] - ray.o[kx]) - ray.s[0] * z;
                out[1][i] = (v[ky][i] - ray.o[ky]) - ray.s[1] * z;
                out[2][i] = z;
            }
        }
        let [a, b, c] = &p;
        let mut e = [[0.0f32; LANES]; 3];
        for i in 0..LANES {
            e[0][i] = c[0][i] * b[1][i] - c[1][i] * b[0][i];
            e[1][i] = a[0][i] * c[1][i] - a[1][i] * c[0][i];
            e[2][i] = b[0][i] * a[1][i] - b[1][i] * a[0][i];
        }
        let sign = |x: f32| x.to_bits() >> 31;
        let same =
            mask::<LANES>(|i| sign(e[0][i]) == sign(e[1][i]) && sign(e[1][i]) == sign(e[2][i]));
        let zero = mask::<LANES>(|i| e[0][i] == 0.0 || e[1][i] == 0.0 || e[2][i] == 0.0);
        if same | zero == 0 {
            return 0;
        }
        let mut found = 0;
        let mut undecided = zero;
        for i in 0..LANES {
            let [u, v, w] = [e[0][i], e[1][i], e[2][i]];
            let det = u + v + w;
            let rcp = 1.0 / det;
            let (bu, bv, bw) = (u * rcp, v * rcp, w * rcp);
            let t = (bu * a[2][i] + bv * b[2][i] + bw * c[2][i]) * ray.s[2];
            // Error bound of t: pbrt 6.8.2.
            let largest = |k: usize| max(max(a[k][i].abs(), b[k][i].abs()), c[k][i].abs());
            let (x, y, z) = (largest(0), largest(1), largest(2));
            let max_e = max(max(u.abs(), v.abs()), w.abs());
            let dx = gamma(6) * (x + z);
            let dy = gamma(6) * (y + z);
            let de = 2.0 * (gamma(3) * x * y + dy * x + dx * y);
            let dt = 3.0 * ((gamma(6) * max_e + de) * z) * rcp.abs() * ray.s[2].abs();
            let bit = 1 << i;
            let near_end = (t - ray.t_min).abs() <= dt || (t - ray.t_max).abs() <= dt;
            if det.abs() < TINY_DET || near_end {
                undecided |= same & bit;
            }
            if t > ray.t_min && t <= t_max {
                found |= bit;
            }
            hits.t[at + i] = t;
            hits.u[at + i] = bv;
            hits.v[at + i] = bw;
        }
        let found = same & found & !undecided;
        found | decide(ray, packet, at, t_max, hits, undecided)
    }
}

/// Resolves the `undecided` lanes of a packet in f64 and returns which of them are hit. Its hits start at lane `at`.
#[inline(always)]
pub(super) fn decide(
    ray: &RaySetup,
    packet: &Packet,
    at: usize,
    t_max: f32,
    hits: &mut PacketHits,
    mut undecided: u32,
) -> u32 {
    let mut found = 0;
    while undecided != 0 {
        let lane = undecided.trailing_zeros() as usize;
        undecided &= undecided - 1;
        if let Some((t, u, v)) = decide_lane(ray, packet, lane, t_max) {
            let to = (at + lane) % (2 * LANES);
            (hits.t[to], hits.u[to], hits.v[to]) = (t, u, v);
            found |= 1 << lane;
        }
    }
    found
}

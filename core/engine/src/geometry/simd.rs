//! Slab and triangle kernels for AVX2: the only `unsafe` code of this module.
//!
//! Same operations in the same order as [`super::portable`] (no fused multiply-add, full-precision division), hence the same
//! hits to the bit; the tests hold both against each other.

use std::arch::x86_64::*;

use super::bvh8::{Child, Node8};
use super::portable::{Kernel, Near, decide};
use super::ray::{Ray, RaySetup};
use super::traverse::{self, Candidate, Start, Tree};
use super::triangle::{LANES, Packet, PacketHits, TINY_DET, gamma};
use super::two_level::{self, Instances, Placed};

/// Proof that the processor has AVX2: only [`Avx2::detect`] makes one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2(());

impl Avx2 {
    /// The proof, if this processor and operating system support AVX2.
    pub fn detect() -> Option<Self> {
        std::arch::is_x86_feature_detected!("avx2").then_some(Self(()))
    }

    /// [`traverse::closest`], compiled for AVX2.
    #[inline(always)]
    pub fn closest(self, tree: &Tree, ray: &Ray) -> Option<Candidate> {
        // SAFETY: `self` proves that AVX2 is available.
        unsafe { closest_avx2(self, tree, ray) }
    }

    /// [`two_level::closest`], compiled for AVX2.
    #[inline(always)]
    pub fn closest_instance(
        self,
        all: &Instances,
        ray: &Ray,
        setup: &RaySetup,
        limit: f32,
    ) -> Option<Placed> {
        // SAFETY: `self` proves that AVX2 is available.
        unsafe { closest_instance_avx2(self, all, ray, setup, limit) }
    }

    /// [`two_level::occluded`], compiled for AVX2.
    #[inline(always)]
    pub fn occluded_instance(self, all: &Instances, ray: &Ray, setup: &RaySetup) -> bool {
        // SAFETY: `self` proves that AVX2 is available.
        unsafe { occluded_instance_avx2(self, all, ray, setup) }
    }

    /// [`traverse::occluded`], compiled for AVX2.
    #[inline(always)]
    pub fn occluded(self, tree: &Tree, ray: &Ray) -> bool {
        // SAFETY: `self` proves that AVX2 is available.
        unsafe { occluded_avx2(self, tree, ray) }
    }
}

// The ray is set up in here, too, so that its constants stay in registers and are made with the same instructions.
#[target_feature(enable = "avx2")]
fn closest_avx2(k: Avx2, tree: &Tree, ray: &Ray) -> Option<Candidate> {
    let ray = RaySetup::new(ray)?;
    traverse::closest(k, tree, &ray, Start::of(&ray), |_| true)
}

#[target_feature(enable = "avx2")]
fn occluded_avx2(k: Avx2, tree: &Tree, ray: &Ray) -> bool {
    RaySetup::new(ray).is_some_and(|ray| traverse::occluded(k, tree, &ray))
}

#[target_feature(enable = "avx2")]
fn closest_instance_avx2(
    k: Avx2,
    all: &Instances,
    ray: &Ray,
    setup: &RaySetup,
    limit: f32,
) -> Option<Placed> {
    two_level::closest(k, all, ray, setup, limit)
}

#[target_feature(enable = "avx2")]
fn occluded_instance_avx2(k: Avx2, all: &Instances, ray: &Ray, setup: &RaySetup) -> bool {
    two_level::occluded(k, all, ray, setup)
}

impl Kernel for Avx2 {
    #[inline(always)]
    fn prefetch(self, tree: &Tree, child: Child) {
        // A node, or the two packets that most leaves have.
        let (start, lines): (*const i8, usize) = if !child.is_leaf() {
            (tree.nodes.as_ptr().wrapping_add(child.0 as usize).cast(), 4)
        } else if !child.is_quadrics() {
            (
                tree.packets
                    .as_ptr()
                    .wrapping_add(child.items().start)
                    .cast(),
                5,
            )
        } else {
            return;
        };
        for line in 0..lines {
            // SAFETY: a prefetch does not access memory, whatever the address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(64 * line)) };
        }
    }

    #[inline(always)]
    fn node(self, ray: &RaySetup, node: &Node8, t_max: f32) -> (u32, Near) {
        // SAFETY: `self` proves that AVX2 is available. Each load reads one row of eight f32; rows are 32 bytes apart in a
        // struct aligned to 32. `near_row` holds row numbers below 6, in pairs of which `^ 1` is the other. The store writes the
        // eight f32 of `near`, aligned to 32.
        unsafe {
            let mut near = _mm256_set1_ps(ray.t_min);
            let mut far = _mm256_set1_ps(t_max);
            // Unrolled by the compiler. On NaN (0·inf) max and min return their second operand: the axis is skipped.
            for axis in 0..3 {
                let row = ray.near_row[axis];
                let o = _mm256_set1_ps(ray.o[axis]);
                let bounds = |row: usize| _mm256_load_ps(node.bounds.get_unchecked(row).as_ptr());
                let n = _mm256_sub_ps(bounds(row), o);
                let f = _mm256_sub_ps(bounds(row ^ 1), o);
                near = _mm256_max_ps(_mm256_mul_ps(n, _mm256_set1_ps(ray.inv_near[axis])), near);
                far = _mm256_min_ps(_mm256_mul_ps(f, _mm256_set1_ps(ray.inv_far[axis])), far);
            }
            let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32;
            let mut out = Near([0.0; 8]);
            _mm256_store_ps(out.0.as_mut_ptr(), near);
            (mask, out)
        }
    }

    #[inline(always)]
    fn packets(self, ray: &RaySetup, packets: &[Packet], t_max: f32, hits: &mut PacketHits) -> u32 {
        // A single packet fills both halves: what the upper one finds is masked away.
        let (pair, lanes) = match packets {
            [] => return 0,
            [one] => ([one, one], 0xf),
            [one, two, ..] => ([one, two], 0xff),
        };
        // SAFETY: `self` proves that AVX2 is available.
        unsafe { packets_avx2(ray, pair, lanes, t_max, hits) }
    }
}

/// Tests eight triangles and returns which of `lanes` are hit.
#[target_feature(enable = "avx2")]
#[inline]
fn packets_avx2(
    ray: &RaySetup,
    pair: [&Packet; 2],
    lanes: u32,
    t_max: f32,
    hits: &mut PacketHits,
) -> u32 {
    // SAFETY: Each load reads one row of four f32; rows are 16 bytes apart in a struct
    // aligned to 32; `k` is a permutation of the three axes. The stores write the rows of `hits`, aligned to 32.
    unsafe {
        let [kx, ky, kz] = ray.k;
        let origin = |axis: usize| _mm256_set1_ps(*ray.o.get_unchecked(axis));
        let (ox, oy, oz) = (origin(kx), origin(ky), origin(kz));
        let (sx, sy) = (_mm256_set1_ps(ray.s[0]), _mm256_set1_ps(ray.s[1]));
        let shear = |vertex: usize| {
            let row = |axis: usize| {
                let half = |p: &Packet| {
                    _mm_load_ps(p.v.get_unchecked(vertex).get_unchecked(axis).as_ptr())
                };
                _mm256_set_m128(half(pair[1]), half(pair[0]))
            };
            let (x, y) = (_mm256_sub_ps(row(kx), ox), _mm256_sub_ps(row(ky), oy));
            let z = _mm256_sub_ps(row(kz), oz);
            (
                _mm256_sub_ps(x, _mm256_mul_ps(sx, z)),
                _mm256_sub_ps(y, _mm256_mul_ps(sy, z)),
                z,
            )
        };
        let (ax, ay, az) = shear(0);
        let (bx, by, bz) = shear(1);
        let (cx, cy, cz) = shear(2);
        let u = _mm256_sub_ps(_mm256_mul_ps(cx, by), _mm256_mul_ps(cy, bx));
        let v = _mm256_sub_ps(_mm256_mul_ps(ax, cy), _mm256_mul_ps(ay, cx));
        let w = _mm256_sub_ps(_mm256_mul_ps(bx, ay), _mm256_mul_ps(by, ax));

        let differ = _mm256_or_ps(_mm256_xor_ps(u, v), _mm256_xor_ps(v, w));
        let same = !(_mm256_movemask_ps(differ) as u32) & lanes;
        let nought = _mm256_setzero_ps();
        let zeros = _mm256_or_ps(
            _mm256_or_ps(
                _mm256_cmp_ps::<_CMP_EQ_OQ>(u, nought),
                _mm256_cmp_ps::<_CMP_EQ_OQ>(v, nought),
            ),
            _mm256_cmp_ps::<_CMP_EQ_OQ>(w, nought),
        );
        let zero = _mm256_movemask_ps(zeros) as u32 & lanes;
        if same | zero == 0 {
            return 0;
        }

        let abs = |x| _mm256_andnot_ps(_mm256_set1_ps(-0.0), x);
        let max3 = |a, b, c| _mm256_max_ps(_mm256_max_ps(abs(a), abs(b)), abs(c));
        let splat = |x: f32| _mm256_set1_ps(x);
        let det = _mm256_add_ps(_mm256_add_ps(u, v), w);
        let rcp = _mm256_div_ps(splat(1.0), det);
        let (bu, bv, bw) = (
            _mm256_mul_ps(u, rcp),
            _mm256_mul_ps(v, rcp),
            _mm256_mul_ps(w, rcp),
        );
        let depth = _mm256_add_ps(
            _mm256_add_ps(_mm256_mul_ps(bu, az), _mm256_mul_ps(bv, bz)),
            _mm256_mul_ps(bw, cz),
        );
        let t = _mm256_mul_ps(depth, splat(ray.s[2]));
        let (lo, hi) = (splat(ray.t_min), splat(t_max));
        let inside = _mm256_and_ps(
            _mm256_cmp_ps::<_CMP_GT_OQ>(t, lo),
            _mm256_cmp_ps::<_CMP_LE_OQ>(t, hi),
        );

        let (x, y, z) = (max3(ax, bx, cx), max3(ay, by, cy), max3(az, bz, cz));
        let max_e = max3(u, v, w);
        let g6 = splat(gamma(6));
        let dx = _mm256_mul_ps(g6, _mm256_add_ps(x, z));
        let dy = _mm256_mul_ps(g6, _mm256_add_ps(y, z));
        let xy = _mm256_mul_ps(_mm256_mul_ps(splat(gamma(3)), x), y);
        let de = _mm256_mul_ps(
            splat(2.0),
            _mm256_add_ps(
                _mm256_add_ps(xy, _mm256_mul_ps(dy, x)),
                _mm256_mul_ps(dx, y),
            ),
        );
        let spread = _mm256_mul_ps(_mm256_add_ps(_mm256_mul_ps(g6, max_e), de), z);
        let dt = _mm256_mul_ps(
            _mm256_mul_ps(_mm256_mul_ps(splat(3.0), spread), abs(rcp)),
            splat(ray.s[2].abs()),
        );
        let near_end = _mm256_or_ps(
            _mm256_cmp_ps::<_CMP_LE_OQ>(abs(_mm256_sub_ps(t, lo)), dt),
            _mm256_cmp_ps::<_CMP_LE_OQ>(abs(_mm256_sub_ps(t, splat(ray.t_max))), dt),
        );
        let tiny = _mm256_cmp_ps::<_CMP_LT_OQ>(abs(det), splat(TINY_DET));
        let undecided = zero | (same & _mm256_movemask_ps(_mm256_or_ps(tiny, near_end)) as u32);
        _mm256_store_ps(hits.t.as_mut_ptr(), t);
        _mm256_store_ps(hits.u.as_mut_ptr(), bv);
        _mm256_store_ps(hits.v.as_mut_ptr(), bw);
        let found = same & _mm256_movemask_ps(inside) as u32 & !undecided;
        if undecided == 0 {
            return found;
        }
        let (low, high) = (undecided & 0xf, undecided >> LANES);
        let high = decide(ray, pair[1], LANES, t_max, hits, high);
        found | decide(ray, pair[0], 0, t_max, hits, low) | high << LANES
    }
}

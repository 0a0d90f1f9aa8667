//! What fills the places that rays start from: lights and the camera.

use super::Scene;
use super::build::shape_bounds;
use crate::light::Bound;
use resolvent_api::vertex::CameraRay;
use resolvent_api::{Aabb, Vec3};

/// The interiors that rays start in, where they are the same for all of a light or of the camera.
#[derive(Default)]
pub struct Starts {
    /// Of walks from each light.
    lights: Vec<Option<u64>>,
    camera: Option<u64>,
}

impl Starts {
    pub fn new(scene: &Scene) -> Self {
        let filled = filled(scene);
        let same = |from: Aabb| {
            let (lo, hi) = (Vec3::from(from.min), Vec3::from(from.max));
            if lo == hi {
                return Some(scene.interiors_at(lo));
            }
            // Everything is clear of an empty box.
            let clear = hi.cmplt(filled.min.into()).any() || lo.cmpgt(filled.max.into()).any();
            clear.then_some(0)
        };
        let light = |light| {
            let at = Bound::of(light, scene.lanes)?;
            same(Aabb::new(at.lo, at.hi))
        };
        Self {
            lights: scene.lights.all.iter().map(light).collect(),
            camera: same(scene.camera.starts()),
        }
    }
}

impl Scene {
    /// The interiors that a walk from the point `o` of a light at a finite place starts in.
    pub(super) fn light_start(&self, light: u32, o: Vec3) -> u64 {
        let same = self.starts.lights.get(light as usize).copied().flatten();
        same.unwrap_or_else(|| self.interiors_at(o))
    }

    /// A ray of the camera, with the interiors that it starts in.
    #[inline(always)]
    pub(super) fn within(&self, ray: CameraRay) -> CameraRay {
        let same = self.starts.camera;
        CameraRay {
            inside: same.unwrap_or_else(|| self.interiors_at(ray.o.into())),
            ..ray
        }
    }
}

/// A box around everything that is filled, wide enough for rays that were moved off a surface.
fn filled(scene: &Scene) -> Aabb {
    let mut filled = Aabb::EMPTY;
    if let Some(accel) = &scene.accel {
        let shapes = accel.geometry().shapes.iter().zip(&scene.surfaces);
        for (shape, _) in shapes.filter(|(_, s)| s.interior.is_some()) {
            filled = shape_bounds(shape, filled);
        }
        let copied = scene.copies.surfaces().iter();
        if let Some((lo, hi)) = accel.instance_bounds()
            && copied.map(|s| s.interior).any(|i| i.is_some())
        {
            filled = filled.including(lo).including(hi);
        }
    }
    let pad = 1e-4 * filled.extent();
    Aabb {
        min: (Vec3::from(filled.min) - pad).into(),
        max: (Vec3::from(filled.max) + pad).into(),
    }
}

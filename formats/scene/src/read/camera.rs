//! The camera, the film, and how long to sample.

use super::Reader;
use super::values::{floats, list, number, text, vec3};
use crate::check::transform;
use crate::describe::{Aov, Budget, Camera, Film, Filter, Pose, Projection, Sampling};
use crate::json::{Data, Node};
use crate::transform::{length, parallel, sub};

impl Reader<'_> {
    pub(super) fn camera(&mut self, node: &Node) -> Option<Camera> {
        let lens_radius = number(node, "lens_radius").unwrap_or(0.0);
        let mut focus_distance = number(node, "focus_distance");
        let pose = match node.get("transform") {
            Some(t) => Pose::Transform(transform(t).ok()?),
            None => {
                let (origin, target) = (vec3(node, "origin")?, vec3(node, "target")?);
                let up = vec3(node, "up").unwrap_or([0.0, 1.0, 0.0]);
                let axis = sub(target, origin);
                if length(axis) == 0.0 {
                    self.checker.report(
                        node.get("target")?,
                        "expected a target unequal to the origin",
                    );
                } else if parallel(axis, up) {
                    let at = node.get("up").unwrap_or(node);
                    self.checker.report(
                        at,
                        format!(
                            "expected \"up\" not to be parallel to the viewing axis, found {up:?}"
                        ),
                    );
                }
                focus_distance = focus_distance.or(Some(length(axis)));
                Pose::LookAt { origin, target, up }
            }
        };
        if lens_radius > 0.0 && focus_distance.is_none() {
            self.checker.report(
                node,
                "perspective with a lens_radius and a transform needs the key \"focus_distance\"",
            );
        }
        let focus_distance = focus_distance.unwrap_or(1.0);
        Some(Camera {
            pose,
            projection: match text(node, "type")? {
                "orthographic" => Projection::Orthographic {
                    width: number(node, "width")?,
                },
                _ => Projection::Perspective {
                    fov_x_deg: number(node, "fov_x_deg")?,
                },
            },
            lens_radius,
            focus_distance,
            shift: node.get("shift").and_then(floats).unwrap_or_default(),
            exposure: number(node, "exposure").unwrap_or(0.0),
        })
    }

    pub(super) fn film(&mut self, node: &Node) -> Option<Film> {
        let resolution: [u32; 2] = match node.get("resolution") {
            Some(n) => self.integers(n)?,
            None => Film::default().resolution,
        };
        let crop: Option<[u32; 4]> = node.get("crop").and_then(|n| self.integers(n));
        if let Some([x0, y0, x1, y1]) = crop
            && (x0 >= x1 || y0 >= y1 || x1 > resolution[0] || y1 > resolution[1])
        {
            let what = format!(
                "expected x0 < x1 ≤ {} and y0 < y1 ≤ {}, found [{x0}, {y0}, {x1}, {y1}]",
                resolution[0], resolution[1]
            );
            self.checker.report(node.get("crop")?, what);
        }
        let filter = node.get("filter").map_or_else(
            || Some(Filter::default()),
            |n| {
                let radius = number(n, "radius");
                match text(n, "type")? {
                    "box" => Some(Filter::Box {
                        radius: radius.unwrap_or(0.5),
                    }),
                    "tent" => Some(Filter::Tent {
                        radius: radius.unwrap_or(1.0),
                    }),
                    "gaussian" => Some(Filter::Gaussian {
                        radius: radius.unwrap_or(1.5),
                        sigma: number(n, "sigma").unwrap_or(0.5),
                    }),
                    _ => None,
                }
            },
        )?;
        let aovs = list(node, "aovs")
            .iter()
            .filter_map(|n| match &n.data {
                Data::Text(t) => Aov::parse(t),
                _ => None,
            })
            .collect();
        Some(Film {
            resolution,
            pixel_aspect: number(node, "pixel_aspect").unwrap_or(1.0),
            crop,
            filter,
            aovs,
        })
    }

    pub(super) fn sampling(&mut self, node: &Node) -> Option<Sampling> {
        let mut sampling = Sampling::default();
        if let Some(spp) = node.get("spp") {
            sampling.budget = Budget::Spp(self.unsigned(spp)?);
        } else if let Some(seconds) = number(node, "time") {
            sampling.budget = Budget::Time(seconds);
        } else if let Some(error) = number(node, "error") {
            sampling.budget = Budget::Error(error);
        }
        if let Some(seed) = node.get("seed") {
            sampling.seed = self.unsigned(seed)?;
        }
        Some(sampling)
    }
}

//! Which tests hold each row of the list of what breaks renderers (`data/physics/stress.json`).

use crate::harness::{list, table, text};
use crate::report;
use std::collections::BTreeSet;
use std::path::Path;

const VDB: &str = "plugins/media/vdb/src/tests/stress.rs";
const MEDIA: &str = "tests/tests/physics/stress_media.rs";
const PLACES: &str = "tests/tests/physics/stress_places.rs";
const WORLD: &str = "tests/tests/physics/stress_world.rs";
const REST: &str = "tests/tests/physics/stress_rest.rs";
const HG: &str = "plugins/phases/hg/src/tests.rs";
const ERRORS: &str = "tests/tests/cli/errors.rs";

/// Row, and the files and names of the tests.
const INDEX: &[(&str, &[(&str, &str)])] = &[
    (
        "optical_thickness_range",
        &[
            (MEDIA, "optical_thickness"),
            (
                "plugins/media/homogeneous/src/tests.rs",
                "transmittance_over_twelve_decades",
            ),
        ],
    ),
    (
        "thin_emission",
        &[
            (MEDIA, "optical_thickness"),
            (
                "plugins/media/homogeneous/src/tests.rs",
                "thin_and_thick_emission",
            ),
        ],
    ),
    ("white_furnace_any_thickness", &[(MEDIA, "white_furnace")]),
    (
        "conservative_thick_slab",
        &[
            (REST, "conservative_thick_slab"),
            ("tests/tests/physics/slab_flux.rs", "slab_flux"),
        ],
    ),
    (
        "mean_number_of_collisions",
        &[(MEDIA, "mean_number_of_collisions")],
    ),
    (
        "twelve_decades_in_one_grid",
        &[(VDB, "twelve_decades_in_one_grid")],
    ),
    ("one_hot_voxel", &[(VDB, "one_hot_voxel")]),
    ("albedo_close_to_one", &[(MEDIA, "albedo_close_to_one")]),
    ("albedo_zero", &[(MEDIA, "coefficients")]),
    ("albedo_above_one_or_negative", &[(MEDIA, "coefficients")]),
    ("hg_near_one_and_zero", &[(HG, "near_one_and_zero")]),
    (
        "g_plus_one",
        &[
            (MEDIA, "coefficients"),
            (HG, "ends_of_the_range_are_refused"),
        ],
    ),
    ("g_minus_one", &[(HG, "ends_of_the_range_are_refused")]),
    (
        "g_out_of_range",
        &[
            (MEDIA, "coefficients"),
            (HG, "ends_of_the_range_are_refused"),
        ],
    ),
    ("small_g_continuity", &[(MEDIA, "coefficients")]),
    ("translation", &[(PLACES, "moved_and_scaled")]),
    ("uniform_scale", &[(PLACES, "moved_and_scaled")]),
    (
        "rotation_and_axis_permutation",
        &[(REST, "turned_and_mirrored"), (PLACES, "transforms")],
    ),
    (
        "sheared_grid",
        &[(VDB, "sheared_grid_and_transforms"), (PLACES, "transforms")],
    ),
    ("singular_transform", &[(PLACES, "transforms")]),
    ("aspect_ratio", &[(PLACES, "transforms")]),
    (
        "medium_resting_on_a_surface",
        &[(PLACES, "resting_on_a_surface")],
    ),
    (
        "coincident_or_separated",
        &[(PLACES, "resting_on_a_surface")],
    ),
    (
        "two_boxes_sharing_a_face",
        &[
            (PLACES, "several_media"),
            (
                "plugins/media/homogeneous/src/tests.rs",
                "slabs_that_touch_are_one_box",
            ),
        ],
    ),
    (
        "box_filled_mesh_and_bounds",
        &[(PLACES, "bounds_and_mesh"), (REST, "box_mesh_and_grid")],
    ),
    (
        "camera_at_the_boundary",
        &[(PLACES, "camera_at_the_boundary")],
    ),
    (
        "camera_moves_through_the_boundary",
        &[(PLACES, "camera_at_the_boundary")],
    ),
    ("void_inside", &[(PLACES, "camera_at_the_boundary")]),
    ("nested_and_overlapping", &[(PLACES, "several_media")]),
    ("n_copies", &[(PLACES, "several_media")]),
    ("partial_overlap", &[(PLACES, "several_media")]),
    (
        "index_matched_boundary",
        &[(
            "tests/tests/physics/materials.rs",
            "an_index_matched_boundary",
        )],
    ),
    (
        "open_or_inverted_mesh",
        &[(REST, "open_and_inverted_meshes")],
    ),
    ("one_voxel", &[(VDB, "one_voxel")]),
    (
        "rays_on_faces_edges_corners",
        &[(VDB, "rays_on_faces_edges_corners")],
    ),
    (
        "zero_density",
        &[
            (VDB, "zero_density_is_empty"),
            (REST, "media_that_are_not_there"),
        ],
    ),
    ("zero_extent", &[(REST, "media_that_are_not_there")]),
    ("inverted_bounds", &[(REST, "media_that_are_not_there")]),
    ("bad_voxels", &[(VDB, "bad_voxels")]),
    ("half_precision_range", &[(VDB, "half_precision_range")]),
    (
        "constant_equals_majorant",
        &[(VDB, "constant_equals_majorant")],
    ),
    ("tiny_and_huge_voxels", &[(REST, "box_mesh_and_grid")]),
    (
        "missing_empty_or_wrong_grid",
        &[(
            "plugins/media/vdb/src/tests/loading.rs",
            "errors_say_what_is_wrong",
        )],
    ),
    ("light_touching_the_medium", &[(WORLD, "lights_and_media")]),
    (
        "point_light_on_the_boundary",
        &[(WORLD, "lights_and_media")],
    ),
    (
        "sphere_light_tangent",
        &[(REST, "a_sphere_light_at_the_boundary")],
    ),
    ("light_inside_opaque_medium", &[(WORLD, "lights_and_media")]),
    ("zero_area_light", &[(WORLD, "odd_lights")]),
    ("zero_power_light", &[(WORLD, "odd_lights")]),
    ("bad_light", &[(WORLD, "odd_lights")]),
    ("sun_in_environment", &[(WORLD, "odd_lights")]),
    ("many_orders_of_magnitude", &[(WORLD, "odd_lights")]),
    (
        "degenerate_triangles",
        &[
            (WORLD, "meshes"),
            (
                "core/engine/tests/geometry_input.rs",
                "degenerate_triangles_are_counted_and_harmless",
            ),
        ],
    ),
    ("bad_vertices", &[(WORLD, "meshes")]),
    (
        "watertight",
        &[
            (WORLD, "meshes"),
            ("core/engine/tests/geometry_watertight.rs", "unit_sphere"),
            (
                "tests/tests/mappings/rays.rs",
                "shared_edges_let_nothing_through",
            ),
        ],
    ),
    (
        "huge_and_tiny_together",
        &[
            (REST, "huge_and_tiny_together"),
            (
                "core/engine/tests/geometry_watertight.rs",
                "close_to_large_triangles",
            ),
        ],
    ),
    ("empty_scene", &[(WORLD, "cameras_and_empty_scenes")]),
    ("no_light", &[(WORLD, "cameras_and_empty_scenes")]),
    (
        "nothing_but_a_medium",
        &[
            ("tests/tests/physics/slab_flux.rs", "slab_flux"),
            (MEDIA, "white_furnace"),
        ],
    ),
    (
        "field_of_view_extremes",
        &[(WORLD, "cameras_and_empty_scenes")],
    ),
    (
        "field_of_view_refused",
        &[(WORLD, "cameras_and_empty_scenes")],
    ),
    ("degenerate_frame", &[(WORLD, "cameras_and_empty_scenes")]),
    (
        "image_sizes",
        &[
            (WORLD, "cameras_and_empty_scenes"),
            (ERRORS, "wrong_options"),
        ],
    ),
    ("zero_extinction_channel", &[(MEDIA, "lanes")]),
    ("white_furnace_chromatic", &[(MEDIA, "white_furnace")]),
    ("zero_albedo_channel", &[(MEDIA, "lanes")]),
    ("grey_equals_rgb", &[(MEDIA, "lanes")]),
    ("permutation", &[(MEDIA, "lanes")]),
    ("zero_light_channel", &[(MEDIA, "lanes")]),
    ("emission_without_extinction", &[(MEDIA, "lanes")]),
    (
        "unbiased_transmittance",
        &[("plugins/media/vdb/src/tests/conformance.rs", "every_kernel")],
    ),
    ("bounce_limit", &[(MEDIA, "white_furnace")]),
    ("threads_and_tiles", &[(MEDIA, "threads_and_ranges")]),
];

/// Every row has tests, and they are there.
#[test]
fn every_row_has_a_test() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let table = table("stress");
    let rows: BTreeSet<&str> = list(&table, "cases")
        .iter()
        .map(|c| text(c, "name"))
        .collect();
    let held: BTreeSet<&str> = INDEX.iter().map(|r| r.0).collect();
    assert_eq!(rows, held);
    assert_eq!(INDEX.len(), held.len(), "a row is there twice");
    for case in list(&table, "cases") {
        let name = text(case, "name");
        let tests = INDEX.iter().find(|r| r.0 == name).map_or(&[][..], |r| r.1);
        assert!(!tests.is_empty(), "{name}");
        for (file, test) in tests {
            let path = root.join(file);
            let source = std::fs::read_to_string(&path)
                .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            let at = source.find(&format!("fn {test}("));
            let before = at.map_or("", |at| &source[..at]);
            assert!(
                before.trim_end().ends_with("#[test]"),
                "{name}: {file} has no test {test}"
            );
        }
        let names: Vec<_> = tests
            .iter()
            .map(|(file, test)| format!("[`{test}`](../{file})"))
            .collect();
        report::line(
            "stress.md",
            &format!(
                "| {name} | {} | {} |",
                text(case, "setup"),
                names.join(", ")
            ),
        );
    }
}

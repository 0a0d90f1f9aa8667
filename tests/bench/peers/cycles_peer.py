"""Blender's Cycles, as the Python module bpy."""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene as common

BOUNCES = 1024  # the most that Cycles allows


def check(a):
    import bpy
    return bpy.app.version_string


def material(bpy, name):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    m.node_tree.nodes.clear()
    return m, m.node_tree, m.node_tree.nodes.new("ShaderNodeOutputMaterial")


def volume(bpy, med):
    """σ_a and σ_s, times the grid's density if there is one."""
    m, tree, out = material(bpy, "medium")
    node = tree.nodes.new("ShaderNodeVolumeCoefficients")
    node.phase = "HENYEY_GREENSTEIN"
    node.inputs["Anisotropy"].default_value = med["g"]
    scatter = [t * a for t, a in zip(med["sigma_t"], med["albedo"])]
    absorb = [t - s for t, s in zip(med["sigma_t"], scatter)]
    for socket, value in (("Absorption Coefficients", absorb), ("Scatter Coefficients", scatter), ("Emission Coefficients", [0, 0, 0])):
        if med["kind"] == "vdb" and any(value):
            density = tree.nodes.new("ShaderNodeAttribute")
            density.attribute_name = med["grid_name"]
            times = tree.nodes.new("ShaderNodeVectorMath")
            times.operation = "SCALE"
            times.inputs[0].default_value = value
            tree.links.new(density.outputs["Fac"], times.inputs["Scale"])
            tree.links.new(times.outputs[0], node.inputs[socket])
        else:
            node.inputs[socket].default_value = value
    tree.links.new(node.outputs[0], out.inputs["Volume"])
    return m


def mesh(bpy, name, points, faces, m):
    data = bpy.data.meshes.new(name)
    data.from_pydata([tuple(p) for p in points], [], faces)
    data.materials.append(m)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, data))


def surface(bpy, x):
    m, tree, out = material(bpy, "surface")
    new = tree.nodes.new
    diffuse = new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*x["reflectance"], 1)
    diffuse.inputs["Roughness"].default_value = 0
    if "emission" not in x:
        tree.links.new(diffuse.outputs[0], out.inputs["Surface"])
        return m
    # Shines from its front alone.
    color = common.rgb(x["emission"])
    strength = max(color)
    shine, geometry, mix = new("ShaderNodeEmission"), new("ShaderNodeNewGeometry"), new("ShaderNodeMixShader")
    shine.inputs["Color"].default_value = (*[c / strength for c in color], 1)
    shine.inputs["Strength"].default_value = strength
    tree.links.new(geometry.outputs["Backfacing"], mix.inputs[0])
    tree.links.new(shine.outputs[0], mix.inputs[1])
    tree.links.new(diffuse.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], out.inputs["Surface"])
    m.cycles.emission_sampling = "FRONT"
    return m


def build(bpy, a, s):
    import math
    import mathutils
    import numpy as np
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    cycles.device = "CPU"
    cycles.samples, cycles.seed = a.spp, a.seed % 2**31
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.volume_biased = False
    for k in ("max", "diffuse", "glossy", "transmission", "volume"):
        setattr(cycles, f"{k}_bounces", BOUNCES)
    cycles.transparent_max_bounces = BOUNCES
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0
    cycles.pixel_filter_type = "BOX"
    render.threads_mode, render.threads = "FIXED", a.threads
    render.resolution_x, render.resolution_y, render.resolution_percentage = *s.size, 100
    settings = render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode, settings.exr_codec = "OPEN_EXR", "32", "RGB", "ZIP"
    render.filepath, render.dither_intensity = os.path.abspath(a.output), 0

    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "HORIZONTAL", math.radians(s.camera["fov_x_deg"])
    camera.clip_start, camera.clip_end = 1e-3, 1e6
    eye, target, up = (np.array(s.camera.get(k, [0, 1, 0]), float) for k in ("origin", "target", "up"))
    z = (eye - target) / np.linalg.norm(eye - target)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = x, np.cross(z, x), z, eye
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.collection.objects.link(scene.camera)
    scene.camera.matrix_world = mathutils.Matrix(m.tolist())

    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    nodes = scene.world.node_tree.nodes
    sky = nodes.get("Background") or nodes.new("ShaderNodeBackground")
    sky.inputs["Color"].default_value = (*(s.environment or [0, 0, 0]), 1)
    sky.inputs["Strength"].default_value = 1 if s.environment else 0
    for l in s.lights:
        if l["type"] == "distant":
            light, value = bpy.data.lights.new("sun", "SUN"), common.rgb(l["irradiance"])
            light.angle, strength = math.radians(l.get("angle_deg", 0)), max(value)
            place = mathutils.Vector(l["to_light"]).to_track_quat("Z", "Y").to_matrix().to_4x4()
        elif l["type"] == "point":
            # Watts of Blender's point lights: intensity I has the power 4 π² I.
            light, value = bpy.data.lights.new("point", "POINT"), common.rgb(l["intensity"])
            light.shadow_soft_size, strength = 0, max(value) * 4 * math.pi**2
            place = mathutils.Matrix.Translation(l["position"])
        else:
            common.unsupported("a spot light, whose rim falls off differently there")
        light.energy, light.color = strength, [v / max(value) for v in value]
        light.cycles.max_bounces = BOUNCES
        holder = bpy.data.objects.new("light", light)
        holder.matrix_world = place
        scene.collection.objects.link(holder)

    for med in s.media:
        m = volume(bpy, med)
        if med["kind"] == "vdb":
            v = bpy.data.volumes.new("volume")
            v.filepath, v.render.precision = med["file"], "FULL"
            v.materials.append(m)
            scene.collection.objects.link(bpy.data.objects.new("volume", v))
            continue
        if "radius" in med:
            common.unsupported("a round medium, which would be a mesh there")
        (x0, y0, z0), (x1, y1, z1) = med["low"], med["high"]
        points = [(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)]
        mesh(bpy, "medium", points, [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)], m)
    for x in s.shapes:
        if x["type"] == "sphere":
            common.unsupported("a sphere, which would be a mesh there")
        mesh(bpy, "surface", x["vertices"], [(0, 1, 2, 3)], surface(bpy, x))


def render(a, clock):
    import bpy
    build(bpy, a, common.Scene(a))
    # Cycles prepares the scene within its one call, so that this is part of its time.
    clock.rendering()
    bpy.ops.render.render(write_still=True)
    if not os.path.exists(a.output) and os.path.exists(a.output + ".exr"):
        os.rename(a.output + ".exr", a.output)
    clock.result()


if __name__ == "__main__":
    sys.exit(common.main(check, render))

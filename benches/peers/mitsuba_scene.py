"""A scene file of this repository as a Mitsuba 3 scene that computes the same radiance.

Equation (1) of the sheet has no 1/pi where Mitsuba's diffuse surfaces have one, so Mitsuba's light is pi times as bright; only
pixels that show the light itself differ, and they are left out of comparisons (`light_mask`).

Surfaces are compared with their faces' own normals (`without_normals`): where an interpolated normal turns away from the viewer,
at the outlines of round things, eq. (1) still has light and Mitsuba's surfaces have none, or that of the other side.
"""
import json
import os
import shutil

import numpy as np


def read_mtl(path):
    """Material name -> {"Kd": rgb, "Ke": rgb}."""
    materials, current = {}, None
    for line in open(path):
        words = line.split()
        if not words:
            continue
        if words[0] == "newmtl":
            current = materials.setdefault(words[1], {"Kd": [0.8] * 3, "Ke": [0.0] * 3})
        elif words[0] in ("Kd", "Ke"):
            current[words[0]] = [float(w) for w in words[1:4]]
    return materials


def read_obj(path):
    """Positions, normals (or None), and for each material its triangles as index pairs (position, normal)."""
    positions, normals, faces, materials, current = [], [], {}, {}, None
    for line in open(path):
        words = line.split()
        if not words:
            continue
        if words[0] == "v":
            positions.append([float(w) for w in words[1:4]])
        elif words[0] == "vn":
            normals.append([float(w) for w in words[1:4]])
        elif words[0] == "mtllib":
            materials = read_mtl(os.path.join(os.path.dirname(path), words[1]))
        elif words[0] == "usemtl":
            current = faces.setdefault(words[1], [])
        elif words[0] == "f":
            corners = []
            for word in words[1:]:
                numbers = word.split("/")
                corners.append((int(numbers[0]) - 1, int(numbers[2]) - 1 if len(numbers) > 2 else -1))
            for k in range(1, len(corners) - 1):
                current.append((corners[0], corners[k], corners[k + 1]))
    return np.array(positions, np.float32), np.array(normals, np.float32), faces, materials


def write_ply(path, positions, normals, triangles):
    """One material's triangles, binary, each corner a vertex of its own group of (position, normal)."""
    pairs = np.array(triangles, np.int64).reshape(-1, 2)
    unique, index = np.unique(pairs, axis=0, return_inverse=True)
    smooth = unique[0, 1] >= 0
    vertices = positions[unique[:, 0]]
    names = ["x", "y", "z"]
    if smooth:
        vertices = np.hstack([vertices, normals[unique[:, 1]]])
        names += ["nx", "ny", "nz"]
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("i", "<i4", 3)])
    faces["n"], faces["i"] = 3, index.reshape(-1, 3)
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    head += [f"property float {n}" for n in names]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    with open(path, "wb") as file:
        file.write(("\n".join(head) + "\n").encode())
        file.write(vertices.astype("<f4").tobytes())
        file.write(faces.tobytes())
    return smooth


def without_normals(config_path, folder):
    """A copy of the scene whose OBJ files have no normals; returns the path of its scene file."""
    os.makedirs(folder, exist_ok=True)
    config = json.load(open(config_path))
    for mesh in config["scene"]["mesh_files"]:
        source, copy = os.path.join(os.path.dirname(config_path), mesh), os.path.join(folder, mesh)
        os.makedirs(os.path.dirname(copy), exist_ok=True)
        with open(copy, "w") as file:
            for line in open(source):
                if line.startswith("f "):
                    line = "f " + " ".join(word.split("/")[0] for word in line.split()[1:]) + "\n"
                if not line.startswith("vn "):
                    file.write(line)
                if line.startswith("mtllib "):
                    library = line.split()[1]
                    shutil.copy(os.path.join(os.path.dirname(source), library), os.path.dirname(copy))
    path = os.path.join(folder, os.path.basename(config_path))
    json.dump(config, open(path, "w"))
    return path


def convert(config_path, folder, mitsuba_sampler, spp):
    """Writes PLY files and an XML scene into `folder`; returns the XML's path and what was read."""
    config = json.load(open(config_path))
    os.makedirs(folder, exist_ok=True)
    camera, frame = config["camera"], config["framebuffer"]
    patches = {p["name"]: p for p in config["scene"].get("materials") or []}
    shapes, light = [], None
    for mesh in config["scene"]["mesh_files"]:
        path = os.path.join(os.path.dirname(config_path), mesh)
        positions, normals, faces, materials = read_obj(path)
        for name, triangles in faces.items():
            ply = os.path.join(folder, f"{name}.ply")
            smooth = write_ply(ply, positions, normals, triangles)
            albedo, glow = materials[name]["Kd"], materials[name]["Ke"]
            strength = patches.get(name, {}).get("emissive_strength", float(np.dot([0.2126, 0.7152, 0.0722], glow)))
            rgb = lambda v: ", ".join(repr(float(x)) for x in v)
            emitter = ""
            if strength > 0:
                radiance = rgb([np.pi * a * strength for a in albedo])
                emitter = f'<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter>'
                light = positions[[c[0] for t in triangles for c in t]]
            flat = "" if smooth else '<boolean name="face_normals" value="true"/>'
            shapes.append(
                f'<shape type="ply"><string name="filename" value="{ply}"/>{flat}'
                f'<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="{rgb(albedo)}"/></bsdf></bsdf>'
                f"{emitter}</shape>"
            )
    vector = lambda v: ", ".join(repr(float(x)) for x in v)
    target = np.add(camera["pos"], camera["dir"])
    lens = camera.get("lens_radius", 0)
    kind = "thinlens" if lens > 0 else "perspective"
    aperture = (
        f'<float name="aperture_radius" value="{lens}"/><float name="focus_distance" value="{camera["focal_depth"]}"/>'
        if lens > 0
        else ""
    )
    xml = f"""<scene version="3.0.0">
<default name="spp" value="{spp}"/>
<default name="sampler" value="{mitsuba_sampler}"/>
<integrator type="direct"><integer name="emitter_samples" value="1"/><integer name="bsdf_samples" value="0"/></integrator>
<sensor type="{kind}"><float name="fov" value="{camera["fov"]}"/><string name="fov_axis" value="y"/>{aperture}
<float name="near_clip" value="0.001"/><float name="far_clip" value="1e5"/>
<transform name="to_world"><lookat origin="{vector(camera["pos"])}" target="{vector(target)}" up="{vector(camera["up"])}"/></transform>
<sampler type="$sampler"><integer name="sample_count" value="$spp"/></sampler>
<film type="hdrfilm"><integer name="width" value="{frame["res_w"]}"/><integer name="height" value="{frame["res_h"]}"/>
<string name="pixel_format" value="rgb"/><string name="component_format" value="float32"/><rfilter type="box"/></film></sensor>
{chr(10).join(shapes)}
</scene>
"""
    path = os.path.join(folder, "scene.xml")
    open(path, "w").write(xml)
    return path, config, light


def light_mask(config, light):
    """True for pixels that count: those off the bounding box of the light's picture, with two pixels' margin."""
    camera, frame = config["camera"], config["framebuffer"]
    width, height = frame["res_w"], frame["res_h"]
    unit = lambda v: np.asarray(v, float) / np.linalg.norm(v)
    forward = unit(camera["dir"])
    right = unit(np.cross(forward, camera["up"]))
    up = np.cross(right, forward)
    seen = light - np.asarray(camera["pos"])
    depth = seen @ forward
    mask = np.ones((height, width), bool)
    if np.all(depth > 0):
        half = np.tan(np.radians(camera["fov"]) / 2)
        x = (seen @ right / depth / (half * width / height) + 1) * width / 2
        y = (1 - seen @ up / depth / half) * height / 2
        left, top = int(np.floor(x.min())) - 2, int(np.floor(y.min())) - 2
        mask[max(top, 0) : max(int(np.ceil(y.max())) + 3, 0), max(left, 0) : max(int(np.ceil(x.max())) + 3, 0)] = False
    return mask

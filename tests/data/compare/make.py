"""Makes the images of this folder with other programs, and their errors with numpy: expected.json.

Needs Python with numpy, OpenEXR (3.5) and Pillow, and on the path exrmaketiled (OpenEXR) and pamtopfm, pnmtopng (Netpbm).
Lossy files are read back by the program that wrote them. Run in this folder; what it makes is committed.
"""
import json
import os
import subprocess

import numpy as np
import OpenEXR
from PIL import Image

W, H = 24, 16
rng = np.random.default_rng(7)
y, x = np.mgrid[0:H, 0:W]
base = np.stack([0.6 + 0.5 * np.sin(x / 3 + c) * np.cos(y / 4 - c) for c in range(3)], axis=-1)
base[3, 5] = 0.0  # black in reference and image: 0/0 of smape, epsilon of rel_mse


def noisy(sigma):
    image = base + rng.normal(0, sigma, base.shape) * (base > 0)
    return image.astype(np.float32)


reference, reference2, test = noisy(0.01), noisy(0.01), noisy(0.08)
test[9, 20] = [30.0, 25.0, 11.0]  # a firefly
replicates = [noisy(0.08) + np.float32(0.004) for _ in range(4)]


def planes(image, prefix="", letters="RGB"):
    return {prefix + letter: np.ascontiguousarray(image[..., i]) for i, letter in enumerate(letters)}


def write_exr(name, channels, compression, header=None):
    header = {"compression": compression, "type": OpenEXR.scanlineimage, **(header or {})}
    OpenEXR.File(header, channels).write(name)


def read_exr(name, channels, part=0):
    with OpenEXR.File(name, separate_channels=True) as file:
        return np.stack([file.parts[part].channels[c].pixels.astype(np.float64) for c in channels], axis=-1)


def read_pfm(name):
    with open(name, "rb") as file:
        kind, size, scale = (file.readline().split() for _ in range(3))
        order, channels = ("<" if float(scale[0]) < 0 else ">"), (3 if kind[0] == b"PF" else 1)
        data = np.frombuffer(file.read(), order + "f4").astype(np.float64) * abs(float(scale[0]))
    image = data.reshape(int(size[1]), int(size[0]), channels)[::-1]
    return np.repeat(image, 3, axis=-1) if channels == 1 else image


def srgb(codes, bits):
    v = codes.astype(np.float64) / (2**bits - 1)
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


images = {}  # file → (pixels in f64, layer)


def keep(name, pixels, layer=None):
    images[name] = (pixels.astype(np.float64), layer)


half = test.astype(np.float16)
coarse = np.abs(np.round(half * 4) / 4).astype(np.float16)  # few values: every compression makes it smaller
write_exr("reference.exr", planes(reference), OpenEXR.ZIP_COMPRESSION)
write_exr("reference2.exr", planes(reference2), OpenEXR.ZIP_COMPRESSION)
for name, pixels, compression in [
    ("half-zip.exr", half, OpenEXR.ZIP_COMPRESSION),
    ("half-piz.exr", coarse, OpenEXR.PIZ_COMPRESSION),
    ("half-b44a.exr", half, OpenEXR.B44A_COMPRESSION),
    ("half-dwaa.exr", half, OpenEXR.DWAA_COMPRESSION),
    ("float-rle.exr", coarse.astype(np.float32), OpenEXR.RLE_COMPRESSION),
    ("float-pxr24.exr", test, OpenEXR.PXR24_COMPRESSION),
    ("uint-zips.exr", np.round(np.abs(test) * 1e8).astype(np.uint32), OpenEXR.ZIPS_COMPRESSION),
]:
    write_exr(name, planes(pixels), compression)
    keep(name, read_exr(name, "RGB"))
window = {"dataWindow": (np.array([-3, 5], np.int32), np.array([W - 4, H + 4], np.int32)),
          "displayWindow": (np.array([0, 0], np.int32), np.array([63, 47], np.int32))}
write_exr("float-window.exr", planes(test), OpenEXR.NO_COMPRESSION, window)
keep("float-window.exr", read_exr("float-window.exr", "RGB"))
subprocess.run(["exrmaketiled", "-m", "-t", "10", "7", "-z", "piz", "half-piz.exr", "half-tiled-mip.exr"], check=True)
keep("half-tiled-mip.exr", coarse)
write_exr("grey.exr", {"Y": np.ascontiguousarray(test[..., 1])}, OpenEXR.ZIP_COMPRESSION)
keep("grey.exr", np.repeat(test[..., 1:2], 3, axis=-1))
layers = {**planes(test), **planes(test * np.float32(0.5), "diffuse."), **planes(base.astype(np.float32), "N.", "XYZ"),
          "A": np.ones((H, W), np.float16), "Z": np.full((H, W), np.inf, np.float32)}
write_exr("layers.exr", layers, OpenEXR.ZIP_COMPRESSION)
keep("layers.exr", test)
keep("layers.exr:diffuse", test * np.float32(0.5), "diffuse")
parts = [OpenEXR.Part({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, planes(image), name)
         for name, image in [("left", test), ("right", test * np.float32(0.25))]]
OpenEXR.File(parts).write("parts.exr")
keep("parts.exr:right", test * np.float32(0.25), "right")
write_exr("half-htj2k.exr", planes(coarse), OpenEXR.HTJ2K256_COMPRESSION)
chroma = {"Y": half[..., 1], "RY": half[..., 0], "BY": half[..., 2]}
write_exr("luminance-chroma.exr", {name: np.ascontiguousarray(plane) for name, plane in chroma.items()}, OpenEXR.ZIP_COMPRESSION)

clipped = np.clip(test, 0, 1)
codes8, codes16 = np.round(clipped * 255).astype(np.uint8), np.round(clipped * 65535).astype(np.uint16)
ppm16 = b"P6\n%d %d\n65535\n" % (W, H) + codes16.astype(">u2").tobytes()
for name, command in [("netpbm-little.pfm", ["pamtopfm", "-endian=little"]),
                      ("netpbm-big-scaled.pfm", ["pamtopfm", "-endian=big", "-scale=2.5"])]:
    with open(name, "wb") as file:
        subprocess.run(command, input=ppm16, stdout=file, check=True)
    keep(name, read_pfm(name))
with open("grey.pfm", "wb") as file:
    file.write(b"Pf\n%d %d\n-1\n" % (W, H) + test[::-1, :, 1].astype("<f4").tobytes())
keep("grey.pfm", read_pfm("grey.pfm"))
for name, mode, codes in [("rgb8.png", "RGB", codes8), ("grey8.png", "L", codes8[..., 1])]:
    Image.fromarray(codes, mode).save(name)
Image.fromarray(np.dstack([codes8, np.full((H, W), 200, np.uint8)]), "RGBA").save("rgba8.png")
Image.fromarray(codes8, "RGB").quantize(16).save("palette.png")
for name in ["rgb8.png", "grey8.png", "palette.png", "rgba8.png"]:
    keep(name, srgb(np.asarray(Image.open(name).convert("RGB")), 8))
for name, options in [("rgb16.png", []), ("gamma16.png", ["-gamma", "0.8"])]:
    with open(name, "wb") as file:
        subprocess.run(["pnmtopng", *options], input=ppm16, stdout=file, stderr=subprocess.DEVNULL, check=True)
keep("rgb16.png", srgb(codes16, 16))
keep("gamma16.png", (codes16 / 65535.0) ** (1 / 0.8))
for i, image in enumerate(replicates):
    name = f"replicate{i}.pfm"
    with open(name, "wb") as file:
        file.write(b"PF\n%d %d\n-1.0\n" % (W, H) + image[::-1].astype("<f4").tobytes())

R1, R2 = reference.astype(np.float64), reference2.astype(np.float64)


def trimmed(terms):
    """Mean without the pixel (0.01 % of 384, at least one) of the largest sum."""
    rows = terms.reshape(-1, 3)
    return float(np.delete(rows, rows.sum(axis=1).argmax(), axis=0).mean())


def metrics(t, r1, r2=None):
    r = r1 if r2 is None else (r1 + r2) / 2
    d = t - r
    total = np.abs(t) + np.abs(r)
    relative = d**2 / (r**2 + 0.01)
    smape = np.divide(np.abs(d), total, out=np.zeros_like(d), where=total > 0)
    found = {"mse": (d**2).mean(), "rmse": np.sqrt((d**2).mean()), "rel_mse": relative.mean(), "mae": np.abs(d).mean(),
             "smape": smape.mean(), "bias": d.mean(), "max_abs": np.abs(d).max(),
             "mse_trimmed": trimmed(d**2), "rel_mse_trimmed": trimmed(relative)}
    if r2 is not None:
        found["mse_unbiased"] = ((t - r1) * (t - r2)).mean()
    return {name: float(value) for name, value in found.items()}


def ensemble(ts, r1, r2):
    """Means over four replicates; Student's 97.5 % quantile at 3 degrees of freedom."""
    quantile = 3.182446305284263
    each = [metrics(t, r1, r2) for t in ts]
    found = {}
    for name in ["mse", "rel_mse", "mae", "smape", "max_abs", "mse_trimmed"]:
        values = np.array([e[name] for e in each])
        half_width = quantile * values.std(ddof=1) / np.sqrt(len(values))
        found[name] = {"value": float(values.mean()), "ci95": [float(values.mean() - half_width), float(values.mean() + half_width)]}
    variance = np.var(ts, axis=0, ddof=1).mean()
    mean = np.mean(ts, axis=0)
    found["variance"] = {"value": float(variance)}
    found["bias2"] = {"value": float(((mean - r1) * (mean - (r1 if r2 is None else r2))).mean() - variance / len(ts))}
    found["bias"] = {"value": float((mean - (r1 if r2 is None else (r1 + r2) / 2)).mean())}
    if r2 is not None:
        found["mse_unbiased"] = {"value": float(np.mean([e["mse_unbiased"] for e in each]))}
    return found


ts = np.stack([image.astype(np.float64) for image in replicates])
expected = {
    "one_reference": [{"file": name.split(":")[0], "layer": layer, **metrics(pixels, R1)} for name, (pixels, layer) in images.items()],
    "two_references": [{"file": name.split(":")[0], "layer": layer, **metrics(pixels, R1, R2)} for name, (pixels, layer) in images.items()],
    "reference_noise_mse": float(((R1 - R2) ** 2).mean() / 4),
    "replicates_one_reference": ensemble(ts, R1, None),
    "replicates_two_references": ensemble(ts, R1, R2),
}
with open("expected.json", "w") as file:
    json.dump(expected, file, indent=1)
    file.write("\n")

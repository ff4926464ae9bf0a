"""Mitsuba 3 and sampler-lab in turn on the same scenes: samples a second, fresh processes, RMSE against one reference.

Called by run.sh. Prints Markdown; ratios above 1 say that sampler-lab is ahead. Each ratio is the median of the ratios of
neighbouring runs, with the smallest and largest of them.
"""
import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import time

import numpy as np

import mitsuba_scene

MITSUBA_SAMPLERS = ["independent", "stratified", "multijitter", "orthogonal", "ldsampler"]
OUR_SAMPLERS = ["uniform", "stratified", "halton", "ld", "sobol"]
# Scene, samples a pixel of the speed comparison (the issue's), of our reference.
SCENES = [("landscape-200k", 26, 512), ("cornell", 64, 2048)]


def ours(binary, scene, sampler, spp, seed, out):
    """Renders with us; seconds of rendering alone, of the whole process, the samples taken, the image."""
    command = [binary, "render", scene, "--sampler", sampler, "--spp", str(spp), "--seed", str(seed)]
    started = time.perf_counter()
    done = subprocess.run(command + ["-o", out, "--json", "-q"], check=True, capture_output=True, text=True)
    whole = time.perf_counter() - started
    report = json.loads(done.stdout)
    return report["render_seconds"], whole, report["spp"]["taken"]


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--binary", required=True)
    arguments.add_argument("--scenes", required=True, help="folder of `sampler-lab bench --write-scenes`")
    arguments.add_argument("--work", required=True, help="folder for what is made on the way")
    arguments.add_argument("--variant", default="llvm_ad_rgb")
    arguments.add_argument("--repeats", type=int, default=7)
    arguments.add_argument("--points", help="file for the points of every sampler, as an experiment's `peers` reads them")
    arguments.add_argument("--only", choices=[s[0] for s in SCENES])
    args = arguments.parse_args()

    import mitsuba as mi

    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)
    import drjit as dr

    def read(path):
        return np.array(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))

    def theirs(scene, spp, seed):
        dr.sync_thread()
        started = time.perf_counter()
        image = mi.render(scene, spp=spp, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        return time.perf_counter() - started, np.array(image)

    processor = next((l.split(":")[1].strip() for l in open("/proc/cpuinfo") if l.startswith("model name")), "?")
    print(f"Mitsuba {mi.__version__} ({args.variant}), {processor}, {os.cpu_count()} threads, {platform.system()},", end=" ")
    print(time.strftime("%Y-%m-%d"), flush=True)
    points = []
    ratio_line = lambda r: f"{statistics.median(r):.2f} ({min(r):.2f} to {max(r):.2f})"

    for name, spp, reference_spp in [s for s in SCENES if args.only in (None, s[0])]:
        folder = os.path.join(args.work, name)
        config_path = mitsuba_scene.without_normals(os.path.join(args.scenes, f"{name}.json"), os.path.join(folder, "ours"))
        xml, config, light = mitsuba_scene.convert(config_path, folder, "independent", spp)
        mask = mitsuba_scene.light_mask(config, light)
        pixels = config["framebuffer"]["res_w"] * config["framebuffer"]["res_h"]
        out = os.path.join(folder, "ours.exr")
        rmse = lambda image: float(np.sqrt(np.mean((image[mask].astype(float) - reference[mask]) ** 2)))

        ours(args.binary, config_path, "sobol", reference_spp, 987654321, out)
        reference = read(out).astype(float)
        print(f"\n### {name}, {pixels} pixels, reference sobol at {reference_spp} samples a pixel\n")
        # Two unbiased programs of one formula agree in their mean within their noise: else nothing below means anything.
        scene = mi.load_file(xml)
        _, image = theirs(scene, 256 if name == "cornell" else 64, 1)
        means = [float(reference[mask].mean()), float(image[mask].mean())]
        print(f"Mean radiance: ours {means[0]:.6f}, Mitsuba {means[1]:.6f}, ratio {means[1] / means[0]:.6f}\n")

        print("| work | ours, s | Mitsuba, s | speed, ours over Mitsuba | RMSE ours | RMSE Mitsuba |")
        print("|---|---|---|---|---|---|", flush=True)
        rows = []
        for i in range(args.repeats + 1):
            seconds, _, _ = ours(args.binary, config_path, "uniform", spp, 10 + i, out)
            error = rmse(read(out))
            their_seconds, image = theirs(scene, spp, 10 + i)
            if i > 0:  # The first is a warm-up of both.
                rows.append((seconds, their_seconds, error, rmse(image)))
        a, b, ea, eb = (statistics.median(c) for c in zip(*rows))
        print(f"| render, {spp} spp, uniform and independent: {pixels * spp / a / 1e6:.1f} and {pixels * spp / b / 1e6:.1f} M samples/s "
              f"| {a:.3f} | {b:.3f} | {ratio_line([r[1] / r[0] for r in rows])} | {ea:.5f} | {eb:.5f} |", flush=True)
        rows = []
        mitsuba = [os.path.join(os.path.dirname(sys.executable), "mitsuba"), "-m", args.variant, "-o", os.path.join(folder, "m.exr"), xml]
        for i in range(args.repeats + 1):
            _, seconds, _ = ours(args.binary, config_path, "uniform", spp, 10 + i, out)
            started = time.perf_counter()
            subprocess.run(mitsuba, check=True, capture_output=True)
            their_seconds = time.perf_counter() - started
            if i > 0:
                rows.append((seconds, their_seconds))
        a, b = (statistics.median(c) for c in zip(*rows))
        print(f"| fresh process to image (Mitsuba reads binary PLY and has its compiled kernels on disk) | {a:.3f} | {b:.3f} "
              f"| {ratio_line([r[1] / r[0] for r in rows])} | | |", flush=True)

        print("\n| sampler at 64 spp | spp taken | render, s | RMSE | RMSE² · s |\n|---|---|---|---|---|", flush=True)
        best = {}
        scenes = {s: mi.load_file(xml, sampler=s, spp=64) for s in MITSUBA_SAMPLERS}
        found = {}
        for i in range(max(3, args.repeats // 2) + 1):
            for sampler in OUR_SAMPLERS:
                seconds, _, taken = ours(args.binary, config_path, sampler, 64, 100 + i, out)
                found.setdefault(("ours", sampler, taken), []).append((seconds, rmse(read(out))))
            for sampler, scene in scenes.items():
                # The sampler rounds the count up to one that it can have.
                taken = scene.sensors()[0].sampler().sample_count()
                seconds, image = theirs(scene, taken, 100 + i)
                found.setdefault(("Mitsuba", sampler, taken), []).append((seconds, rmse(image)))
        for (program, sampler, taken), runs in found.items():
            seconds, error = (statistics.median(c) for c in zip(*runs[1:]))
            cost = statistics.median([s * e * e for s, e in runs[1:]])
            best[program] = min(best.get(program, float("inf")), cost)
            if mask.all():  # An error over some of the pixels is not what an experiment's figure shows.
                points.append(point(f"Mitsuba {mi.__version__}" if program == "Mitsuba" else "sampler-lab (peers' run)", sampler, name,
                                    config["framebuffer"], taken, runs[1:], processor))
            print(f"| {program}: {sampler} | {taken} | {seconds:.3f} | {error:.5f} | {cost:.3e} |")
        print(f"\nRMSE² · s at 64 spp, best of each program: ours {best['ours']:.3e}, Mitsuba {best['Mitsuba']:.3e}, "
              f"ratio {best['Mitsuba'] / best['ours']:.2f}", flush=True)

    if args.points and points:
        write_points(args.points, points)


def point(program, sampler, scene, framebuffer, spp, runs, processor):
    """One program, sampler and scene: medians and ranges over the runs."""
    seconds, errors = zip(*runs)
    digits = lambda x: float(f"{x:.4g}")
    return {
        "name": f"{program} {sampler}", "scene": scene, "size": f"{framebuffer['res_w']}x{framebuffer['res_h']}", "spp": int(spp),
        "seconds": digits(statistics.median(seconds)), "seconds_range": [digits(min(seconds)), digits(max(seconds))],
        "rmse": digits(statistics.median(errors)), "rmse_range": [digits(min(errors)), digits(max(errors))],
        "machine": f"{processor}, {os.cpu_count()} threads", "date": time.strftime("%Y-%m-%d"),
    }


def write_points(path, points):
    """Whole or not at all."""
    note = "warm renders, medians and ranges"
    with open(path + ".partial", "w") as file:
        lines = ",\n    ".join(json.dumps(p, ensure_ascii=False) for p in points)
        file.write(f"{{\n  \"note\": {json.dumps(note)},\n  \"points\": [\n    {lines}\n  ]\n}}\n")
    os.replace(path + ".partial", path)


main()

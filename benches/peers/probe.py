"""Fails where Mitsuba's LLVM variant cannot compile and run a small scene."""
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
scene = mi.load_dict(mi.cornell_box())
assert mi.render(scene, spp=1).shape[2] == 3

"""Runs in Blender's Python: imports a glTF, lights it by one point light and renders it from above.

    python blender_render.py FILE.glb OUT.exr JSON    JSON: light, view (in metres), half_side, size

The render is linear: radiance at a light for which a white sheet facing it at the light's distance from the
centre would be 1.
"""

import json
import math
import sys

import bpy

file, out, told = sys.argv[-3:]
scene_of = json.loads(told)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=file)
[panel] = [item for item in bpy.data.objects if item.type == "MESH"]
panel.rotation_mode = "XYZ"
panel.rotation_euler = (-math.pi / 2, 0, 0)  # the importer stands it up; we look down on it

scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.samples = 64
scene.cycles.use_denoising = False
scene.cycles.max_bounces = 0
scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
scene.cycles.filter_width = 0.01  # pixel centres are texel centres, as in our renderer
scene.render.threads_mode = "FIXED"
scene.render.threads = 1
scene.render.resolution_x = scene.render.resolution_y = scene_of["size"]
scene.view_settings.view_transform = "Raw"
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = out
scene.world = None

light = bpy.data.lights.new("lamp", "POINT")
light.shadow_soft_size = 0
distance2 = sum(value**2 for value in scene_of["light"])
light.energy = (
    4 * math.pi**2 * distance2
)  # radiant intensity pi x distance^2, so irradiance pi there
lamp = bpy.data.objects.new("lamp", light)
lamp.location = scene_of["light"]
scene.collection.objects.link(lamp)

height = scene_of["view"][2]
camera = bpy.data.cameras.new("camera")
camera.sensor_width = 36
camera.lens = 36 / 2 * height / scene_of["half_side"]
camera.clip_start = height / 100
eye = bpy.data.objects.new("camera", camera)
eye.location = (0, 0, height)
scene.collection.objects.link(eye)
scene.camera = eye
bpy.ops.render.render(write_still=True)

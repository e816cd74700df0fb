# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Shows the cut through a part in Blender, as a rectangle that is moved and turned like any object.

Start `ccslice view PART` and copy the address that it prints. Then, in Blender's Python console:

    exec(open("ccslice_cut.py").read()); ccslice_cut("http://127.0.0.1:PORT/#token=...", "hardness")

Move or turn the object "ccslice cut": the picture follows. `ccslice_probe()` says what is at the 3D cursor. One unit of
Blender's is a millimetre. Without a window, to write one picture:

    blender --background --python ccslice_cut.py -- ADDRESS CHANNEL OUTPUT.png
"""

import json
import os
import sys
import tempfile
import urllib.parse
import urllib.request

import bpy
from mathutils import Vector

_PIXELS = 512
_NAME = "ccslice cut"
_state = {}
_OPENER = urllib.request.build_opener(urllib.request.ProxyHandler({}))  # `ccslice view` is on this machine.


def _call(path, body=None):
    """An answer of `ccslice view`: its bytes and its headers. Raises urllib.error.HTTPError."""
    request = urllib.request.Request(_state["server"] + path, data=None if body is None else json.dumps(body).encode(),
                                     headers={"Authorization": "Bearer " + _state["token"]})
    with _OPENER.open(request, timeout=30) as answer:
        return answer.read(), answer.headers


def _message(vector):
    return dict(zip("xyz", map(float, vector)))


def _fetch(matrix, stage):
    """The cut in the plane of a square from (-0.5, -0.5) to (0.5, 0.5), as PNG."""
    across, up = matrix.col[0].xyz, matrix.col[1].xyz
    up -= up.project(across)  # At right angles, however the object is sheared.
    plane = {"middle_mm": _message(matrix.translation), "across": _message(across.normalized()),
             "up": _message(up.normalized()), "across_mm_per_pixel": across.length / _PIXELS,
             "up_mm_per_pixel": up.length / _PIXELS}
    content = {"channel": {"channel": _state["channel"]}} if _state["channel"] else {"occupancy": {}}
    body = {"width": _PIXELS, "height": _PIXELS, "plane": {"free": plane}, "content": content}
    return _call("api/preview?stage=" + stage, body)[0]


def _show(stage):
    picture = _fetch(_state["object"].matrix_world, stage)
    with open(_state["file"], "wb") as file:
        file.write(picture)
    _state["image"].reload()


def _follow():
    """While the object moves coarse pictures come, and the full one when it rests."""
    if _NAME not in bpy.data.objects:
        return None
    matrix = _state["object"].matrix_world.copy()
    if matrix != _state["shown"]:
        _show("coarse")
        _state.update(shown=matrix, rests=False)
    elif not _state["rests"]:
        _show("full")
        _state["rests"] = True
    return 0.05


def _rectangle(image):
    mesh = bpy.data.meshes.new(_NAME)
    mesh.from_pydata([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)], [], [(0, 1, 2, 3)])
    for corner, uv in zip(mesh.uv_layers.new().data, ((0, 0), (1, 0), (1, 1), (0, 1))):
        corner.uv = uv
    material = bpy.data.materials.new(_NAME)
    material.use_nodes, material.blend_method = True, "BLEND"
    nodes, links = material.node_tree.nodes, material.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    shader = nodes["Principled BSDF"]
    links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    links.new(texture.outputs["Alpha"], shader.inputs["Alpha"])
    mesh.materials.append(material)
    rectangle = bpy.data.objects.new(_NAME, mesh)
    bpy.context.scene.collection.objects.link(rectangle)
    return rectangle


def ccslice_cut(address, channel=""):
    """Makes the rectangle in the middle of the part, as large as the part."""
    server, _, fragment = address.partition("#")
    _state.update(server=server, token=urllib.parse.parse_qs(fragment)["token"][0], channel=channel)
    known = json.loads(_call("api/meshes")[0])
    box = next(mesh for mesh in known["meshes"] if mesh["mesh_id"] == known["first"])["bounding_box"]
    low, high = (Vector([box[end][axis] for axis in "xyz"]) for end in ("min_mm", "max_mm"))
    _state["file"] = os.path.join(tempfile.mkdtemp(prefix="ccslice_"), "cut.png")
    rectangle = _rectangle(bpy.data.images.new(_NAME, 1, 1))
    rectangle.location, size = (low + high) / 2, (high - low).length
    rectangle.scale = (size, size, size)
    bpy.context.view_layer.update()
    _state.update(object=rectangle, shown=None, rests=False)
    with open(_state["file"], "wb") as file:
        file.write(_fetch(rectangle.matrix_world, "full"))
    image = _state["image"] = bpy.data.images.load(_state["file"])
    rectangle.active_material.node_tree.nodes["Image Texture"].image = image
    if not bpy.app.background:
        bpy.app.timers.register(_follow)
    return rectangle


def ccslice_probe(point=None):
    """What is at a point, or at the 3D cursor: a dictionary of channels, or None outside."""
    place = list(point or bpy.context.scene.cursor.location)
    answer = json.loads(_call("api/probe", {"points_mm": place})[0])
    if answer["locations"][0] != "POINT_LOCATION_INSIDE":
        return None
    known = json.loads(_call("api/meshes")[0])
    channels = next(mesh for mesh in known["meshes"] if mesh["mesh_id"] == known["first"])["channels"]
    return {channel["name"]: value for channel, value in zip(channels, answer["channel_values"])}


if bpy.app.background and "--" in sys.argv:
    _address, _channel, _output = sys.argv[sys.argv.index("--") + 1:]
    cut = ccslice_cut(_address, _channel)
    os.replace(_state["file"], _output)
    print("middle", *(f"{x:.6f}" for x in cut.location), "size", f"{cut.scale[0]:.6f}", "is",
          ccslice_probe(cut.location))

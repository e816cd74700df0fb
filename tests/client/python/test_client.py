# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""The Python client against real servers. run.py sets the environment: CCSLICED, CCSLICE, PYTHONPATH."""

import inspect
import itertools
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import warnings
import zlib
from concurrent import futures
from unittest import mock

import grpc
import numpy as np
import zstandard
from google.protobuf import json_format

import ccslice
import ccslice.client
import ccslice.errors
from ccslice import connection, layers, preview
from ccslice import volume as volume_module
from ccslice.v1 import info_pb2, job_pb2, mesh_pb2, plan_pb2, points_pb2, preview_pb2, slice_pb2, surface_pb2

REPOSITORY = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(REPOSITORY / "tests/support"))
from ccsliced_process import Server  # noqa: E402

CCSLICED, CCSLICE = os.environ["CCSLICED"], os.environ["CCSLICE"]
CORNERS = np.array([[x, y, z] for z in (0, 10) for y in (0, 10) for x in (0, 10)], dtype=float)
HEXAHEDRON = np.array([[0, 1, 3, 2, 4, 5, 7, 6]])
EDGES = [(0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (3, 7), (2, 6)]


def cube(**options):
    """10 mm a side, all edges sharp, so that the limit is the cube; channel g is x / 10."""
    return ccslice.Mesh(CORNERS, HEXAHEDRON, {"g": CORNERS[:, 0] / 10}, sharp_edges=EDGES, **options)


def block(n):
    """n x n x n cells of 1 mm."""
    places = np.stack(np.meshgrid(*3 * [np.arange(n + 1)], indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange((n + 1) ** 3).reshape(3 * [n + 1])
    corners = [number[x:n + x, y:n + y, z:n + z].ravel() for x, y, z in CORNERS.astype(int)[HEXAHEDRON[0]] // 10]
    return ccslice.Mesh(places.astype(float), np.stack(corners, axis=-1))


def private_folders(folder):
    return [name for name in os.listdir(folder) if name.startswith("ccsliced-")]


def comes_true(condition, seconds=10):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


def missing_mesh(mesh_id):
    """The details of a failure for want of the mesh."""
    classes = ccslice.errors._detail_classes()
    status = classes["Status"](code=grpc.StatusCode.FAILED_PRECONDITION.value[0])
    status.details.add().Pack(classes["ErrorInfo"](reason="MESH_MISSING"))
    status.details.add().Pack(classes["ResourceInfo"](resource_name=mesh_id))
    return status.SerializeToString()


def with_raw_planes(open_stream):
    """Asks for planes as they are, whether there is zstandard or not."""
    def asked(request):
        for plane in request.job.planes:
            plane.encoding = job_pb2.PLANE_ENCODING_RAW
        return open_stream(request)

    return asked


def busy_for(seconds, nanos):
    """The details of a failure that asks to be called again after that long."""
    classes = ccslice.errors._detail_classes()
    retry = classes["RetryInfo"]()
    retry.retry_delay.seconds, retry.retry_delay.nanos = seconds, nanos
    status = classes["Status"](code=grpc.StatusCode.UNAVAILABLE.value[0], message="busy")
    status.details.add().Pack(retry)
    return status.SerializeToString()


class Stream:
    """Messages, as a call gives them."""

    def __init__(self, messages):
        self._messages = iter(messages)

    def __iter__(self):
        return self

    def __next__(self):
        return next(self._messages)

    def cancel(self):
        pass


class Values(unittest.TestCase):
    """What calls give, against what is known of a cube."""

    @classmethod
    def setUpClass(cls):
        cls.client = ccslice.Client(local=True)
        cls.mesh = cube()

    @classmethod
    def tearDownClass(cls):
        cls.client.close()

    def test_a_port_that_does_not_exist_is_told(self):
        for address in ("localhost:65536", "dns:///slicer:0", "dns:slicer:70000", "ipv6:[::1]:99999"):
            with self.assertRaisesRegex(ValueError, "there is no port"):
                ccslice.Client(address)

    def test_a_socket_without_a_path_is_told(self):
        with self.assertRaisesRegex(ValueError, "path of a socket"):
            ccslice.Client("unix:")

    def test_an_address_without_a_port_is_told(self):
        for address in ("localhost", "10.0.0.1", "slicer.example,localhost:50051", "http://localhost:50051"):
            with self.assertRaisesRegex(ValueError, "an address is HOST:PORT, such as localhost:50051", msg=address):
                ccslice.Client(address, local=False)
        for address in ("localhost:50051", "[::1]:50051", "https://slicer.example", "unix:/run/ccslice.sock",
                        "unix-abstract:ccslice", "dns:///slicer.example", "ipv4:10.0.0.1:50051", "xds:///slicers"):
            ccslice.Client(address, local=False).close()

    def test_upload_says_what_the_mesh_is(self):
        summary = self.client.upload(self.mesh)
        self.assertEqual(summary.mesh_id, self.mesh.id)
        self.assertAlmostEqual(summary.deviation.limit_volume_mm3, 1000, places=6)

    def test_upload_tells_how_far_the_preparation_is(self):
        with mock.patch.object(ccslice.client, "_ASK_EVERY_S", 0.01):
            told = []
            self.client.upload(block(40), on_preparation=lambda answer: told.append((answer.phase, answer.done_cells)))
        self.assertTrue(told)
        self.assertEqual(told, sorted(set(told)))
        self.assertLess(told[-1][0], mesh_pb2.PREPARATION_PHASE_PREPARED)

    def test_what_on_preparation_raises_ends_the_upload(self):
        def stop(answer):
            raise KeyError(answer.phase)

        mesh = block(41)
        with mock.patch.object(ccslice.client, "_ASK_EVERY_S", 0.01):
            self.assertRaises(KeyError, lambda: self.client.upload(mesh, on_preparation=stop))
        self.assertEqual(self.client.upload(mesh).control_cells, 41 ** 3)

    def test_an_older_server_is_asked_once_how_far_it_is(self):
        class Unimplemented(grpc.RpcError):
            def code(self):
                return grpc.StatusCode.UNIMPLEMENTED

        with mock.patch.object(ccslice.client, "_ASK_EVERY_S", 0.01), \
                mock.patch.object(self.client._stub, "begin_question") as asked:
            asked.return_value.result.side_effect = Unimplemented
            self.client.upload(block(22), on_preparation=self.fail)
        self.assertEqual(asked.call_count, 1)

    def test_an_answer_that_never_comes_holds_no_upload_up(self):
        cancelled = threading.Event()

        def result():
            self.assertTrue(cancelled.wait(60))
            raise grpc.FutureCancelledError

        with mock.patch.object(ccslice.client, "_ASK_EVERY_S", 0.01), \
                mock.patch.object(self.client._stub, "begin_question") as asked:
            asked.return_value.result = result
            asked.return_value.cancel = cancelled.set
            self.assertEqual(self.client.upload(block(23), on_preparation=self.fail).control_cells, 23 ** 3)
        self.assertEqual(asked.call_count, 1)

    def test_plan(self):
        plan = self.client.plan(self.mesh, (1, 2, 0.5))
        self.assertEqual((plan.grid.extent.columns, plan.grid.extent.rows, plan.layer_count), (10, 5, 20))

    def test_channels_have_the_values_at_voxel_centres(self):
        layers = list(self.client.slice(self.mesh, 1, channels=["g"], occupancy=True, contours=True))
        self.assertEqual([layer.index for layer in layers], list(range(10)))
        for layer in layers:
            self.assertAlmostEqual(layer.z_mm, layer.index + 0.5)
            self.assertEqual(layer.channels["g"].dtype, np.float32)
            np.testing.assert_allclose(layer.channels["g"], np.tile((np.arange(10) + 0.5) / 10, (10, 1)), atol=2e-5)
            self.assertTrue(layer.occupancy.all())
            self.assertEqual(layer.voxel_count, 100)
            self.assertEqual(len(layer.contours), 1)

    def test_integers_stand_for_the_range(self):
        layer = next(self.client.slice(self.mesh, 1, channels={"g": "uint8"}, value_ranges={"g": (0, 2)}))
        np.testing.assert_array_equal(layer.channels["g"][0], np.round((np.arange(10) + 0.5) / 20 * 255).astype(np.uint8))
        layer = next(self.client.slice(self.mesh, 1, channels={"g": np.uint16}))
        self.assertEqual(layer.channels["g"].dtype, np.uint16)
        self.assertLess(abs(int(layer.channels["g"][3, 9]) - round(0.95 * 65535)), 3)

    def test_outside_is_told_apart(self):
        shape = {"extent": (12, 10, 1), "origin_mm": (0, 0, 0)}
        layer = next(self.client.slice(self.mesh, 1, channels=["g"], outside=float("nan"), **shape))
        self.assertTrue(np.isnan(layer.channels["g"][:, 10:]).all())
        self.assertFalse(np.isnan(layer.channels["g"][:, :10]).any())
        layer = next(self.client.slice(self.mesh, 1, channels={"g": "uint8"}, outside=255, **shape))
        self.assertTrue((layer.channels["g"][:, 10:] == 255).all())

    def test_halftones_have_the_fractions(self):
        printing = ccslice.Printing({"a": "#ff0000", "b": (0, 0, 255)}, ccslice.blend("g", {0: "a", 1: "b"}))
        voxels = np.stack([layer.materials for layer in self.client.slice(self.mesh, 0.5, printing=printing)])
        self.assertEqual(voxels.shape, (20, 20, 20))
        self.assertEqual(set(np.unique(voxels)), {1, 2})
        np.testing.assert_allclose((voxels == 2).mean(axis=(0, 1)), (np.arange(20) + 0.5) / 20, atol=0.06)

    def test_overrides_go_before_the_map(self):
        rest = ccslice.where("g", 0.75, "b", ccslice.blend("g", {0: "a", 1: "b"}))
        printing = ccslice.Printing({"a": "#ff0000", "b": "#0000ff", "c": "#00ff00"},
                                    ccslice.where("g", 0.5, "c", rest), strict=True)
        self.assertEqual([(o.channel, o.below, o.material) for o in printing.message.map.overrides],
                         [("g", 0.5, "c"), ("g", 0.75, "b")])
        self.assertTrue(printing.message.map.strict)
        voxels = np.stack([layer.materials for layer in self.client.slice(self.mesh, 0.5, printing=printing)])
        self.assertTrue((voxels[:, :, :10] == 3).all())
        self.assertTrue((voxels[:, :, 10:15] == 2).all())
        self.assertEqual(set(np.unique(voxels[:, :, 15:])), {1, 2})

    def test_amounts_of_materials(self):
        printing = ccslice.Printing({"a": "#ff0000", "b": "#0000ff", "nothing": None},
                                    ccslice.where("g", 0.25, "nothing", ccslice.where("g", 0.5, "b", "a")),
                                    densities={"a": 1.25})
        a, b, nothing = printing.amounts(self.client.slice(self.mesh, 0.5, printing=printing))
        self.assertEqual((a.name, a.voxels, b.voxels, nothing.voxels), ("a", 4000, 2000, 2000))
        self.assertAlmostEqual(a.cm3, 0.5)
        self.assertAlmostEqual(a.share, 2 / 3)
        self.assertAlmostEqual(a.grams, 0.625)
        self.assertEqual((b.grams, nothing.share), (None, None))
        self.assertAlmostEqual(nothing.cm3, 0.25)
        with self.assertRaisesRegex(ValueError, "'nothing', which is left empty and weighs nothing"):
            ccslice.Printing({"a": "#ff0000", "nothing": None}, densities={"nothing": 1})
        with self.assertRaisesRegex(ValueError, "one is enough"):
            ccslice.Printing({"a": "#ff0000", "nothing": None, "none": None})
        other = ccslice.Printing({"a": "#ff0000"})
        with self.assertRaisesRegex(ValueError, "counts 3 materials, and the printing has 1"):
            other.amounts(self.client.slice(self.mesh, 0.5, printing=printing))

    def test_the_plan_warns(self):
        printing = ccslice.Printing({"a": "#ff0000", "b": "#0000ff"}, ccslice.blend("g", {0.4: "a", 0.6: "b"}))
        with self.assertWarnsRegex(ccslice.PlanWarning, "channel 'g' runs from 0 to 1") as caught:
            next(self.client.slice(self.mesh, 0.5, printing=printing))
        self.assertEqual(os.path.basename(caught.filename), "test_client.py")

    def test_arguments_have_names(self):
        for method in (self.client.slice, self.client.plan, self.client.job):
            parameters = inspect.signature(method).parameters
            self.assertIn("printing", parameters)
            self.assertIn("channel_tolerance", parameters)
            self.assertNotIn("job", parameters)
        self.assertIn("layers", inspect.signature(self.client.slice).parameters)

    def test_nothing_is_left_empty_and_kept_out(self):
        rest = ccslice.where("g", 0.25, "a", ccslice.blend("g", {0: "a", 1: "nothing"}), instead_of="nothing")
        printing = ccslice.Printing({"a": "#ff0000", "nothing": None}, rest)
        self.assertTrue(printing.message.materials[1].leaves_empty)
        layers = list(self.client.slice(self.mesh, 0.5, printing=printing, occupancy=True))
        for layer in layers:
            np.testing.assert_array_equal(layer.occupancy, layer.materials == 1)
            self.assertEqual(layer.voxel_count, int((layer.materials == 1).sum()))
            self.assertFalse((layer.materials[:, :5] == 2).any())
        self.assertTrue(any((layer.materials == 2).any() for layer in layers))

    def test_layers_region_placement_and_profile(self):
        layers = list(self.client.slice(self.mesh, 1, layers=range(3, 5)))
        self.assertEqual([layer.index for layer in layers], [3, 4])
        turned = np.array([[0, -1, 0, 10], [1, 0, 0, 0], [0, 0, 1, 0]])
        layer = next(self.client.slice(self.mesh, 1, channels=["g"], placement=turned))
        np.testing.assert_allclose(layer.channels["g"][:, 0], (np.arange(10) + 0.5) / 10, atol=2e-5)
        layer = next(self.client.slice(self.mesh, 1, box_mm=((2, 2, 4), (5, 4, 6))))
        self.assertEqual((layer.index, layer.occupancy.shape), (4, (2, 3)))
        layer = next(self.client.slice(self.mesh, printer="j750-hm", layers=range(5, 6)))
        self.assertEqual(layer.occupancy.shape, (118, 236))

    def test_cell_regions(self):
        points = np.array([[x, y, z] for x in (0, 1, 2) for y in (0, 1) for z in (0, 1)], dtype=float)
        cells = [[0, 4, 6, 2, 1, 5, 7, 3], [4, 8, 10, 6, 5, 9, 11, 7]]
        mesh = ccslice.Mesh(points, cells, regions=["left", "right"])
        layer = next(self.client.slice(mesh, 0.25, layers=range(1, 2), cell_regions=True))
        self.assertEqual(set(np.unique(layer.cell_regions)) - {0}, {1, 2})
        self.assertTrue((np.diff(layer.cell_regions[2][layer.cell_regions[2] > 0].astype(int)) >= 0).all())
        layer = next(self.client.slice(mesh, 0.25, layers=range(1, 2), contours_by_cell_region=True))
        self.assertEqual(layer.contour_regions, [1, 2])
        self.assertEqual([contour.shape[1] for contour in layer.contours], [2, 2])

    def test_tetrahedra_and_wedges_by_name(self):
        points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 2.0]])
        mesh = ccslice.Mesh(points, {"wedge": [[0, 1, 2, 3, 4, 5]], "tetra": [[3, 4, 5, 6]]})
        self.assertEqual(self.client.upload(mesh).control_cells, 2)

    def test_probe_and_evaluate_agree(self):
        points = np.array([[5, 5, 5], [2, 7, 1], [20, 0, 0]])
        probe = self.client.probe(self.mesh, points)
        np.testing.assert_array_equal(probe.inside, [True, True, False])
        np.testing.assert_allclose(probe.channels["g"], [0.5, 0.2, np.nan], atol=1e-9)
        limit = self.client.evaluate(self.mesh, probe.limit_cells[:2], probe.uvw[:2])
        np.testing.assert_allclose(limit.positions_mm, points[:2], atol=1e-9)
        np.testing.assert_allclose(limit.channels["g"], [0.5, 0.2], atol=1e-9)
        self.assertEqual(limit.jacobians_mm.shape, (2, 3, 3))
        self.assertEqual(self.client.probe(self.mesh, np.empty((0, 3))).inside.shape, (0,))

    def test_tessellate(self):
        surface = self.client.tessellate(self.mesh)
        a, b, c = (surface.points_mm[surface.triangles[:, i]] for i in range(3))
        self.assertAlmostEqual(np.einsum("ij,ij->", a, np.cross(b, c)) / 6, 1000, places=6)
        np.testing.assert_allclose(surface.channels["g"], surface.points_mm[:, 0] / 10, atol=1e-6)

    def test_regions_are_numbered_by_their_size(self):
        points = np.array([[x, y, z] for x in range(13) for y in (0, 1) for z in (0, 1)], dtype=float)
        cells = [[4 * i, 4 * i + 4, 4 * i + 6, 4 * i + 2, 4 * i + 1, 4 * i + 5, 4 * i + 7, 4 * i + 3] for i in range(12)]
        mesh = ccslice.Mesh(points, cells, regions=np.arange(12))
        self.assertEqual(mesh.region_names, [str(i) for i in range(12)])
        layer = next(self.client.slice(mesh, 0.25, layers=range(1, 2), cell_regions=True))
        numbers = layer.cell_regions[2][layer.cell_regions[2] > 0].astype(int)
        self.assertTrue((np.diff(numbers) >= 0).all())
        self.assertEqual(numbers.max(), 12)

    def test_several_parts(self):
        def moved(x):
            return np.array([[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]])

        right = moved(15)
        parts = [ccslice.Part(self.mesh), ccslice.Part(self.mesh, placements=[right, moved(23)])]
        layer = next(self.client.slice(parts, 1, channels=["g"], occupancy=True))
        self.assertEqual(layer.occupancy.shape[1], 33)
        self.assertEqual(layer.occupancy[0].tolist(), [True] * 10 + [False] * 5 + [True] * 18)
        np.testing.assert_allclose(layer.channels["g"][0, 15:25], layer.channels["g"][0, :10], atol=2e-5)
        first = [ccslice.Part(self.mesh), ccslice.Part(self.mesh, placements=[moved(5)], priority=1)]
        layer = next(self.client.slice(first, 1, channels=["g"]))
        np.testing.assert_allclose(layer.channels["g"][0, 8], 0.35, atol=2e-5)
        printing = ccslice.Printing({"white": "#ffffff", "black": "#101010"}, "white")
        layer = next(self.client.slice([ccslice.Part(self.mesh), ccslice.Part(self.mesh, [right], map="black")], 1,
                                       printing=printing))
        self.assertEqual(layer.materials[0].tolist(), [1] * 10 + [0] * 5 + [2] * 10)
        self.assertEqual(layer.voxels_covered, 0)
        layer = next(self.client.slice(first, 1, occupancy=True))
        self.assertEqual(layer.voxels_covered, 5 * layer.occupancy.shape[0])
        with self.assertRaisesRegex(ccslice.CallError, "part 2.*part 1"):
            next(self.client.slice(first, 1, overlaps="refuse"))
        self.assertEqual(layer.part_voxels, [5 * layer.occupancy.shape[0], 10 * layer.occupancy.shape[0]])
        snapped = [ccslice.Part(self.mesh, placements=[moved(0), moved(20.25)])]
        layer = next(self.client.slice(snapped, 1, channels=["g"], snap=True))
        self.assertEqual(layer.channels["g"].shape[1], 30)
        np.testing.assert_array_equal(layer.channels["g"][:, 20:], layer.channels["g"][:, :10])
        with self.assertRaisesRegex(ValueError, "overlaps is one of"):
            self.client.plan(first, 1, overlaps="never")
        with self.assertRaisesRegex(ValueError, "give printing"):
            self.client.plan([ccslice.Part(self.mesh, map="black")], 1)
        for wrong in ([self.mesh], [ccslice.Part(self.mesh, name="a"), 3]):
            with self.assertRaises(ValueError):
                self.client.plan(wrong, 1)
        with self.assertRaises(ValueError):
            self.client.plan(parts, 1, placement=right)
        with self.assertRaisesRegex(ccslice.CallError, "another part's"):
            self.client.plan([ccslice.Part(self.mesh, name="a"), ccslice.Part(self.mesh, name="a")], 1)

    def test_fields_and_cuts(self):
        fields = {"height": "z/10", "sum": ccslice.Field("g + 10*height", value_range=(0, 6))}
        layers = list(self.client.slice(self.mesh, 1, channels=["height", "sum"], fields=fields))
        np.testing.assert_allclose(layers[3].channels["height"], np.full((10, 10), 0.35), atol=1e-6)
        expected = np.minimum(6, np.tile((np.arange(10) + 0.5) / 10, (10, 1)) + 6.5)
        np.testing.assert_allclose(layers[6].channels["sum"], expected, atol=1e-4)
        moved = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 100]])
        layer = next(self.client.slice(self.mesh, 1, channels=["up"], placement=moved,
                                       fields={"up": ccslice.Field("z", frame="world")}))
        np.testing.assert_allclose(layer.channels["up"], np.full((10, 10), 100.5), atol=1e-4)
        layer = next(self.client.slice(self.mesh, 1, occupancy=True, fields={"right": "x > 7"}, cut="right"))
        self.assertEqual(layer.occupancy[4].tolist(), [True] * 7 + [False] * 3)
        self.assertEqual((layer.voxel_count, layer.voxels_cut), (70, 30))
        probe = self.client.probe(self.mesh, [[5, 5, 5], [20, 0, 0]], fields={"sum": "g + 100*y"})
        np.testing.assert_allclose(probe.channels["sum"], [500.5, np.nan], atol=1e-4)
        planes = [ccslice.Plane((5, 5, 5))]
        picture = next(self.client.preview(self.mesh, planes, 0.5, size=(40, 40), channel="shade",
                                           fields={"shade": "x/10"}, cut="g"))
        self.assertLess(picture.value_range[1], 0.52)
        self.assertEqual(int((picture.rgba[..., 3] != 0).sum()), 10 * 20)
        for wrong in ({"a": 3}, {"a": ccslice.Field("x", frame="moon")}):
            with self.assertRaisesRegex(ValueError, "fields\\['a'\\]"):
                self.client.plan(self.mesh, 1, fields=wrong)
        with self.assertRaisesRegex(ccslice.CallError, "column 1.*gyroid"):
            self.client.plan(self.mesh, 1, fields={"a": "gyriod(x, y, z)"})

    def test_densities_go_with_materials(self):
        printing = ccslice.Printing({"white": "#ffffff", "black": "#101010"}, "white", densities={"black": 1.2})
        job = self.client.job(self.mesh, 1, printing=printing)
        self.assertEqual([material.density_g_per_cm3 for material in job.printing.materials], [0, 1.2])
        for wrong in ({"grey": 1}, {"white": 0}, {"white": float("nan")}):
            with self.assertRaisesRegex(ValueError, "densities"):
                ccslice.Printing({"white": "#ffffff"}, densities=wrong)

    def test_volumes(self):
        """Samples at the middles of voxels of 1 mm of a box of 10 mm."""
        k, j, i = np.mgrid[0:10, 0:10, 0:10]
        ramp = i + 20 * j + 0.5 * k
        layers = list(self.client.slice(self.mesh, 1, channels=["v"], fields={"v": ramp}))
        np.testing.assert_allclose([layer.channels["v"] for layer in layers], ramp, atol=1e-4)
        integers = ramp.astype(np.int32)
        volume = ccslice.Volume(integers.astype(">u2"), spacing_mm=1, origin_mm=(0.5, 0.5, 0.5), nearest=True)
        layers = list(self.client.slice(self.mesh, 1, channels=["v"], fields={"v": volume}))
        np.testing.assert_array_equal([layer.channels["v"] for layer in layers], integers)
        self.assertEqual(repr(volume), "<ccslice.Volume: 10 x 10 x 10 samples>")
        matrix = np.array([[2, 0, 0, 1], [0, 2, 0, 1], [0, 0, 2, 1]])
        volume = ccslice.Volume(np.stack([ramp, -ramp], axis=-1)[:5, :5, :5], index_to_mm=matrix, channel=1, slope=2,
                                intercept=1, outside=np.float32(7))
        probe = self.client.probe(self.mesh, [[3, 5, 7], [9.5, 9.5, 9.5]], fields={"v": volume})
        np.testing.assert_allclose(probe.channels["v"], [1 - 2 * (1 + 40 + 1.5), 1 - 2 * (4 + 80 + 2)], atol=1e-4)
        holes = np.where(i < 5, np.nan, ramp)
        layer = next(self.client.slice(self.mesh, 1, channels=["v"], fields={"v": ccslice.Volume(holes, outside=-1)}))
        np.testing.assert_allclose(layer.channels["v"], np.where(i < 5, -1, ramp)[0], atol=1e-4)
        picture = next(self.client.preview(self.mesh, [ccslice.Plane((5, 5, 5))], 0.5, size=(40, 40), channel="v",
                                           fields={"v": ramp}))
        self.assertGreater(picture.value_range[1], 180)
        world = ccslice.Volume(ramp, frame="world", value_range=(0, 5))
        layer = next(self.client.slice(self.mesh, 1, channels=["v"], fields={"v": world}))
        self.assertEqual(layer.channels["v"].max(), 5)
        for wrong, said in ((lambda: ccslice.Volume(ramp[0]), "shape"), (lambda: ccslice.Volume([[[np.inf]]]), "infinite"),
                            (lambda: ccslice.Volume(ramp, origin_mm=(0, 0, 0)), "spacing_mm"),
                            (lambda: ccslice.Volume(ramp, index_to_mm=np.eye(2)), "index_to_mm"),
                            (lambda: ccslice.Volume(ramp, index_to_mm=np.eye(4), spacing_mm=1), "leave out"),
                            (lambda: ccslice.Volume(ramp, frame="moon"), "frame"),
                            (lambda: ccslice.Volume(np.ma.masked_less(ramp, 3)), "masked")):
            with self.assertRaisesRegex(ValueError, said):
                wrong()
        with self.assertRaisesRegex(ccslice.CallError, "last channel is 0"):
            self.client.plan(self.mesh, 1, fields={"v": ccslice.Volume(ramp, channel=1)})

    def test_volumes_of_functions_and_of_arrays_with_coordinates(self):
        volume = ccslice.Volume.from_function(lambda x, y, z: x * x + y - z, ((0, 0, 0), (10, 10, 10)), samples=21)
        self.assertAlmostEqual(volume.error, 0.25 * 0.25, places=12)
        self.assertIn("within 0.0625 of its function", repr(volume))
        points = np.random.default_rng(3).uniform(0.01, 9.99, (200, 3))
        probe = self.client.probe(self.mesh, points, fields={"v": volume})
        x, y, z = points.T
        self.assertLess(np.abs(probe.channels["v"] - (x * x + y - z)).max(), 0.0626)
        for box, samples in ((((0, 0, 0), (0, 1, 1)), 5), (((0, 0, 0), (1, 1, 1)), 1)):
            with self.assertRaisesRegex(ValueError, "make no grid"):
                ccslice.Volume.from_function(lambda x, y, z: x, box, samples)
        with self.assertRaisesRegex(ValueError, "shape"):
            ccslice.Volume.from_function(lambda x, y, z: 3, ((0, 0, 0), (1, 1, 1)))

        class Array:  # What is asked of an xarray.DataArray.
            def __init__(self, values, dims, coordinates):
                self.values, self.dims, self.coordinates = values, dims, coordinates

            def __getitem__(self, dim):
                return self.coordinates[dim]

            def transpose(self, *dims):
                return Array(self.values.transpose([self.dims.index(dim) for dim in dims]), dims, self.coordinates)

        places = {"x": np.linspace(0, 10, 6), "y": np.linspace(10, 0, 11), "z": np.linspace(0, 10, 3)}
        grid = np.meshgrid(places["y"], places["x"], places["z"], indexing="ij")
        array = Array(100 * grid[1] + 10 * grid[0] + grid[2], ("y", "x", "z"), places)
        probe = self.client.probe(self.mesh, [[3, 4.5, 7]], fields={"v": array})
        np.testing.assert_allclose(probe.channels["v"], [300 + 45 + 7], rtol=1e-6)
        places["x"] = places["x"]**2
        with self.assertRaisesRegex(ValueError, "evenly spaced"):
            ccslice.Volume.from_xarray(Array(array.values, array.dims, places))
        with self.assertRaisesRegex(ValueError, "not one with time, x"):
            ccslice.Volume.from_xarray(Array(np.zeros((2, 2)), ("time", "x"), {}))

    def test_volumes_are_packed_without_zstandard(self):
        for size in (1, 131072, 131073, 400000):
            content = bytes(range(256)) * (size // 256) + b"x" * (size % 256)
            frame = volume_module._stored(content)
            self.assertEqual(zstandard.ZstdDecompressor().decompress(frame, max_output_size=size), content)
        volume = ccslice.Volume(np.arange(1000.0).reshape(10, 10, 10))
        with mock.patch.object(volume_module, "_packed", volume_module._stored):
            stored = ccslice.Volume(np.arange(1000.0).reshape(10, 10, 10))
        self.assertNotEqual(volume.id, stored.id)
        layers = [next(self.client.slice(self.mesh, 1, channels=["v"], fields={"v": each})) for each in (volume, stored)]
        np.testing.assert_array_equal(layers[0].channels["v"], layers[1].channels["v"])

    def test_a_job_is_a_message_that_files_hold(self):
        job = self.client.job(self.mesh, 1, channels=["g"])
        read = json_format.Parse(json_format.MessageToJson(job), type(job)())
        self.assertEqual(read, job)
        said = [layer.channels["g"] for layer in self.client.slice(self.mesh, 1, channels=["g"])]
        for layer, expected in zip(self.client.slice(read), said):
            np.testing.assert_array_equal(layer.channels["g"], expected)
        self.assertEqual(self.client.plan(read).layer_count, len(said))
        with self.assertRaisesRegex(ValueError, "says the whole job"):
            self.client.plan(read, 1)

    def test_placements_have_three_rows_or_four(self):
        three = np.array([[0, -1, 0, 10], [1, 0, 0, 0], [0, 0, 1, 0]])
        four = np.vstack([three, [0, 0, 0, 1]])
        pictures = [next(self.client.slice(self.mesh, 1, channels=["g"], placement=matrix)).channels["g"]
                    for matrix in (three, four)]
        np.testing.assert_array_equal(*pictures)
        with self.assertRaises(ValueError):
            self.client.plan(self.mesh, 1, placement=np.ones((4, 4)))

    def test_pictures_are_read_only(self):
        layer = next(self.client.slice(self.mesh, 1, channels=["g"], occupancy=True))
        for picture in (layer.occupancy, layer.channels["g"]):
            with self.assertRaises(ValueError):
                picture[0, 0] = 1

    def test_progress(self):
        seen = []
        for _ in self.client.slice(self.mesh, 2, on_progress=lambda done, total: seen.append((done, total))):
            pass
        self.assertEqual(seen, [(i + 1, 5) for i in range(5)])

    def test_layers_are_those_of_the_command_line(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([CCSLICE, "models", "ring", "-o", f"{folder}/ring.ccmesh", "--quiet"], check=True,
                           stdout=subprocess.DEVNULL)
            ring = ccslice.Mesh.from_file(f"{folder}/ring.ccmesh")
            pictures = {}
            for proved, options in ((False, []), (True, ["--prove-channels"])):
                output = pathlib.Path(f"{folder}/layers_{proved}")
                subprocess.run([CCSLICE, "slice", f"{folder}/ring.ccmesh", "--server", self.client.address, "--pitch",
                                "0.2", "--channel", "hardness:f32", "--encoding", "raw", "--layers", "10..12", "-o",
                                str(output), "--quiet", *options], check=True, stdout=subprocess.DEVNULL)
                layers = list(self.client.slice(ring, 0.2, channels=["hardness"], layers=range(10, 13),
                                                prove_channels=proved))
                pictures[proved] = [layer.channels["hardness"].tobytes() for layer in layers]
                self.assertEqual(pictures[proved], [(output / f"layer_{layer.index:04}_hardness.bin").read_bytes()
                                                    for layer in layers])
            self.assertNotEqual(pictures[False], pictures[True])

    def test_errors_name_reason_and_field(self):
        with self.assertRaises(ccslice.CallError) as caught:
            self.client.plan(self.mesh, -1)
        self.assertEqual(caught.exception.reason, "PITCH_INVALID")
        self.assertEqual(caught.exception.metadata["field"], "job.grid.pitch.x_mm")
        with self.assertRaises(ccslice.CallError) as caught:
            list(self.client.slice(self.mesh, 1, channels=["nosuch"]))
        self.assertEqual(caught.exception.reason, "CHANNEL_UNKNOWN")
        with self.assertRaises(ccslice.CallError) as caught:
            self.client.plan("sha256:" + "0" * 64, 1)
        self.assertEqual(caught.exception.reason, "MESH_MISSING")
        with self.assertRaises(ccslice.CallError) as caught:
            self.client.upload(ccslice.Mesh(CORNERS, [[0, 1, 3, 2, 4, 5, 7, 7]]))
        self.assertEqual(caught.exception.reason, "MESH_REPEATED_VERTEX")


class WrongArguments(unittest.TestCase):
    """Arrays that don't fit are named, with what fits; all that can be read is."""

    def refused(self, text, make):
        with self.assertRaises(ValueError) as caught:
            make()
        self.assertIn(text, str(caught.exception))

    def test_arrays(self):
        self.refused("points must have shape (n, 3), not (24,)", lambda: ccslice.Mesh(CORNERS.ravel(), HEXAHEDRON))
        self.refused("points takes numbers", lambda: ccslice.Mesh([["a", "b", "c"]], HEXAHEDRON))
        self.refused("isn't finite, at [3, 1]", lambda: ccslice.Mesh(
            np.where(np.arange(24).reshape(8, 3) == 10, np.nan, CORNERS), HEXAHEDRON))
        self.refused("(m, 8), (m, 6) or (m, 4), not (1, 5)", lambda: ccslice.Mesh(CORNERS, HEXAHEDRON[:, :5]))
        self.refused("whole numbers, not float64", lambda: ccslice.Mesh(CORNERS, HEXAHEDRON + 0.5))
        self.refused("from 0 to 7", lambda: ccslice.Mesh(CORNERS, HEXAHEDRON + 1))
        self.refused("from 0 to 7", lambda: ccslice.Mesh(CORNERS, HEXAHEDRON - 1))
        self.refused("channels['g'] must have shape (8,), not (7,)", lambda: ccslice.Mesh(CORNERS, HEXAHEDRON, {"g": np.zeros(7)}))
        self.refused("sharp_edges must have shape (k, 2)", lambda: ccslice.Mesh(CORNERS, HEXAHEDRON, sharp_edges=[1, 2]))
        self.refused("hexahedron, tetra and wedge, not 'quad'", lambda: ccslice.Mesh(CORNERS, {"quad": [[0, 1, 2, 3]]}))
        self.refused("cells['tetra'] must have shape (m, 4)", lambda: ccslice.Mesh(CORNERS, {"tetra": HEXAHEDRON}))
        self.refused("cells must have shape", lambda: ccslice.Mesh(CORNERS, [[0, 1, 2, 3], [4, 5, 6]]))
        self.refused("points takes numbers", lambda: ccslice.Mesh(CORNERS * 1j, HEXAHEDRON))
        self.refused("one for each cell, not (2,)", lambda: ccslice.Mesh(CORNERS, HEXAHEDRON, regions=[1, 2]))

    def test_masked_arrays(self):
        column = CORNERS[:, 0] / 10
        masked = np.ma.array(column, mask=column > 0.5, fill_value=1e20)
        self.refused("channels['g'] holds 4 masked values, the first at [1]",
                     lambda: ccslice.Mesh(CORNERS, HEXAHEDRON, {"g": masked}))
        self.refused("points holds 1 masked value, the first at [2, 0]", lambda: ccslice.Mesh(
            np.ma.array(CORNERS, mask=np.arange(24).reshape(8, 3) == 6), HEXAHEDRON))
        self.refused("points holds 1 masked value", lambda: ccslice.Mesh(
            [np.ma.array(row, mask=[False, False, i == 3]) for i, row in enumerate(CORNERS)], HEXAHEDRON))
        everything = np.ones_like(HEXAHEDRON, bool)
        for cells in (np.ma.array(HEXAHEDRON, mask=everything), [np.ma.array(HEXAHEDRON, mask=everything)],
                      {"hexahedron": np.ma.array(HEXAHEDRON, mask=everything)}):
            self.refused("masked value", lambda: ccslice.Mesh(CORNERS, cells))
        self.refused("regions holds 1 masked", lambda: ccslice.Mesh(CORNERS, HEXAHEDRON, regions=np.ma.array([1], mask=[1])))
        self.refused("sharp_edges holds 2 masked", lambda: ccslice.Mesh(
            CORNERS, HEXAHEDRON, sharp_edges=np.ma.array([[0, 1]], mask=True)))
        nothing = np.ma.array(column, mask=False)
        self.assertEqual(ccslice.Mesh(CORNERS, HEXAHEDRON, {"g": nothing}, sharp_edges=EDGES).id, cube().id)
        self.assertEqual(ccslice.Mesh(CORNERS, HEXAHEDRON, {"g": masked.filled(1)}, sharp_edges=EDGES).id, cube().id)

        class Looks:
            points = CORNERS
            point_data = {"g": masked}
            cells_dict = {"hexahedron": HEXAHEDRON}

        self.refused("channels['g'] holds 4 masked", lambda: ccslice.Mesh.from_meshio(Looks))

    def test_regions(self):
        self.refused("regions must have shape (1,), one for each cell, not (1, 1)",
                     lambda: ccslice.Mesh(CORNERS, HEXAHEDRON, regions=[[1]]))
        self.refused("regions takes names", lambda: ccslice.Mesh(CORNERS, np.repeat(HEXAHEDRON, 2, 0), regions=[1, None]))

    def test_any_layout_and_type_of_arrays(self):
        mesh = cube()
        fortran = ccslice.Mesh(np.asfortranarray(CORNERS), np.asfortranarray(HEXAHEDRON).astype(np.int16),
                               {"g": (CORNERS / 10)[:, 0]}, sharp_edges=np.array(EDGES)[:, ::-1][:, ::-1])
        self.assertEqual(fortran.id, mesh.id)
        every_other = np.repeat(CORNERS, 2, axis=0)[::2]
        self.assertEqual(ccslice.Mesh(every_other, HEXAHEDRON.tolist(), {"g": every_other[:, 0] / 10}, sharp_edges=EDGES).id,
                         mesh.id)

    def test_points_in_one_place_are_told(self):
        points = np.vstack([CORNERS, CORNERS + (10, 0, 0)])
        cells = np.vstack([HEXAHEDRON, HEXAHEDRON + 8])
        with self.assertWarnsRegex(UserWarning, "^points lie where another one does, 4 in all"):
            self.assertEqual(ccslice.Mesh(points, cells).point_count, 16)
        points, first, new = np.unique(points, axis=0, return_index=True, return_inverse=True)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.assertEqual(ccslice.Mesh(points, new.ravel()[cells]).point_count, 12)
            ccslice.Mesh(np.vstack([points, points]), new.ravel()[cells])  # No cell uses the others.

    def test_meshio_and_pyvista(self):
        class Looks:
            points = CORNERS
            point_data = {"g": CORNERS[:, 0] / 10, "normals": CORNERS}

        Looks.cells_dict = {"hexahedron": HEXAHEDRON, "quad": HEXAHEDRON[:, :4]}
        self.assertEqual(ccslice.Mesh.from_meshio(Looks, sharp_edges=EDGES).id, cube().id)
        Looks.cells_dict = {12: HEXAHEDRON, 9: HEXAHEDRON[:, :4]}
        self.assertEqual(ccslice.Mesh.from_pyvista(Looks, sharp_edges=EDGES).id, cube().id)
        Looks.cells_dict = {"quad": HEXAHEDRON[:, :4]}
        self.refused("no hexahedra", lambda: ccslice.Mesh.from_meshio(Looks))

    def test_jobs(self):
        with ccslice.Client(local=True) as client:
            mesh = cube()
            self.refused("give a pitch", lambda: client.plan(mesh))
            self.refused("pitch takes three numbers", lambda: client.plan(mesh, (1, 2)))
            self.refused("placement must have shape", lambda: client.plan(mesh, 1, placement=np.eye(3)))
            self.refused("list of names", lambda: client.plan(mesh, 1, channels="g"))
            self.refused("must be one of uint8", lambda: client.plan(mesh, 1, channels={"g": "float64"}))
            self.refused("mesh is a ccslice.Mesh", lambda: client.plan(CORNERS, 1))
            for text in ("part.ccmesh", "sha256:" + "0" * 63, "sha256:" + "F" * 64):
                self.refused("Mesh.from_file reads .ccmesh files", lambda: client.plan(text, 1))
            for layers in (range(3, 3), range(0, 9, 2), range(-1, 3)):
                self.refused("a range of step 1, from 0 on, that isn't empty",
                             lambda: list(client.slice(mesh, 1, layers=layers)))
            for layers in ((0, 9), [0, 9], 5, slice(0, 9), "0..9"):
                self.refused(f"layers takes a range, such as range(0, 10) for layers 0 to 9, not {layers!r}",
                             lambda: list(client.slice(mesh, 1, layers=layers)))
            self.refused("box_mm takes two corners", lambda: client.plan(mesh, 1, box_mm=(1, 2, 3)))
            self.refused("box_mm takes three numbers", lambda: client.plan(mesh, 1, box_mm=((1, 2), (3, 4, 5))))
            for count in (2.5, np.inf, np.nan):
                self.refused("extent takes whole numbers", lambda: client.plan(mesh, 1, extent=(count, 1, 1)))
            self.refused("pitch takes three numbers, or one for all, not 'thin'", lambda: client.plan(mesh, "thin"))
            self.refused("pitch holds 1 masked", lambda: client.plan(mesh, np.ma.array([1, 1, 1], mask=[0, 0, 1])))
            self.refused("value_ranges['g'] takes two numbers",
                         lambda: client.plan(mesh, 1, channels={"g": "uint8"}, value_ranges={"g": 1}))
            self.refused("value_ranges names 'h', which channels doesn't",
                         lambda: client.plan(mesh, 1, channels={"g": "uint8"}, value_ranges={"h": (0, 1)}))
            self.refused("channels is empty", lambda: client.plan(mesh, 1, outside=1))
            self.refused("placement holds 1 masked",
                         lambda: client.plan(mesh, 1, placement=np.ma.array(np.eye(4), mask=np.eye(4) * [0, 0, 1, 0])))
            rows = [np.ma.array([1, 2], mask=[0, 1]), np.ma.array([1, 2, 3])]
            self.refused("points_mm takes numbers of shape (n, 3)", lambda: client.probe(mesh, rows))
            self.refused("points_mm holds 3 masked", lambda: client.probe(mesh, np.ma.array([[1, 2, 3]], mask=True)))
            self.refused("limit_cells holds 1 masked",
                         lambda: client.evaluate(mesh, np.ma.array([0], mask=True), [[0.5, 0.5, 0.5]]))
            self.refused("whole numbers, not float64", lambda: client.evaluate(mesh, [0.0], [[0.5, 0.5, 0.5]]))
            self.refused("size takes two numbers", lambda: next(client.preview(mesh, [], 1, size=512)))
            self.refused("middle takes three numbers",
                         lambda: list(client.preview(mesh, [ccslice.Plane((1, 2))], 1)))
            self.refused("normal takes three numbers",
                         lambda: list(client.preview(mesh, [ccslice.Plane((1, 2, 3), "up")], 1)))
            self.refused("points_mm must have shape (n, 3)", lambda: client.probe(mesh, [1, 2, 3]))
            for cell in (-1, 2**32):
                self.refused("from 0 to 4294967295", lambda: client.evaluate(mesh, [cell], [[0.5, 0.5, 0.5]]))
            self.refused("limit_cells must have shape (1,)", lambda: client.evaluate(mesh, [0, 1], [[0.5, 0.5, 0.5]]))
        for colour in ("red", "#+12345", "#12_456"):
            self.refused("'#RRGGBB'", lambda: ccslice.Printing({"a": colour}))
        self.refused("from 0 to 255", lambda: ccslice.Printing({"a": (0, 0, 256)}))
        self.refused("whole numbers from 0 to 255", lambda: ccslice.Printing({"a": (0.1, 0.2, 0.3)}))
        self.refused("halftone is one of", lambda: ccslice.Printing({"a": "#ff0000"}, halftone="dots"))
        self.refused("no address", lambda: ccslice.Client("localhost:1", local=True))
        with tempfile.NamedTemporaryFile() as file:
            file.write(b"no mesh at all")
            file.flush()
            self.refused("isn't a .ccmesh file", lambda: ccslice.Mesh.from_file(file.name))


class WrongAnswers(unittest.TestCase):
    """A server that doesn't give what it was asked for."""

    @classmethod
    def setUpClass(cls):
        cls.client = ccslice.Client(local=True)
        cls.right = staticmethod(cls.client._stub.SliceRange)

    @classmethod
    def tearDownClass(cls):
        cls.client.close()

    def refused(self, text, answer):
        """`answer`: the messages in place of those that came."""
        self.client._stub.SliceRange = lambda request: Stream(answer(list(self.right(request))))
        with self.assertRaises(ccslice.AnswerError) as caught:
            list(self.client.slice(cube(), 5, channels=["g"]))
        self.assertIn(text, str(caught.exception))

    def changed(self, change):
        def answer(messages):
            for message in messages:
                change(message)
            return messages

        return answer

    def test_streams(self):
        self.refused("without a header", lambda messages: [])
        self.refused("another request", lambda messages: messages[1:])
        self.refused("ended before its summary", lambda messages: messages[:-1])

    def test_planes(self):
        def another_type(message):
            if message.WhichOneof("event") == "header":
                message.header.planes[0].sample_type = 99

        def a_byte_less(message):
            if message.WhichOneof("event") == "layer_begin":
                message.layer_begin.encoded_bytes[0] -= 1
            elif message.WhichOneof("event") == "plane_chunk":
                message.plane_chunk.data = message.plane_chunk.data[:-1]

        def another_byte(message):
            if message.WhichOneof("event") == "plane_chunk":
                message.plane_chunk.data = b"?" + message.plane_chunk.data[1:]

        self.refused("another request", self.changed(another_type))
        self.refused("another size", self.changed(a_byte_less))
        self.refused("checksum", self.changed(another_byte))

    def test_compressed_planes(self):
        from ccslice.layers import _inflated

        try:
            import zstandard
        except ImportError:
            self.skipTest("there is no zstandard")
        frame = zstandard.ZstdCompressor().compress(bytes(100))
        self.assertEqual(_inflated(frame, 100), bytes(100))
        for wrong, size in ((frame, 99), (frame[:-1], 100), (b"no frame at all", 100)):
            with self.assertRaises(ccslice.AnswerError):
                _inflated(wrong, size)


class EndlessAnswers(unittest.TestCase):
    """Servers that send more than they announce, announce more than there can be, or never end."""

    @staticmethod
    def header(loops_only=False):
        header = slice_pb2.SliceHeader(layer_count=1)
        header.grid.extent.columns, header.grid.extent.rows = 100, 100
        if not loops_only:
            header.planes.add(encoding=job_pb2.PLANE_ENCODING_RAW, sample_type=job_pb2.SAMPLE_TYPE_UINT8)
        return header

    def objection(self, assembler, messages):
        """To the last message, the first one that is refused."""
        for message in messages[:-1]:
            assembler.add(message)
        try:
            assembler.add(messages[-1])
        except ccslice.AnswerError as error:
            return str(error)
        return ""

    def test_planes(self):
        def begin(size):
            return slice_pb2.SliceRangeResponse(layer_begin=slice_pb2.LayerBegin(encoded_bytes=[size]))

        def chunk(offset, size):
            return slice_pb2.SliceRangeResponse(plane_chunk=slice_pb2.PlaneChunk(offset=offset, data=bytes(size)))

        def objection(*messages):
            return self.objection(layers.Assembler(self.header()), messages)

        self.assertEqual(objection(begin(10_000), chunk(0, 6_000), chunk(6_000, 4_000)), "")
        self.assertIn("longer than announced", objection(begin(10_000), chunk(0, 6_000), chunk(6_000, 4_001)))
        self.assertIn("an empty chunk", objection(begin(10_000), chunk(0, 0)))
        self.assertIn("impossible size", objection(begin(8 << 20)))
        self.assertIn("impossible size", objection(begin((1 << 64) - 1)))

    def test_contours(self):
        def begin(loops):
            return slice_pb2.SliceRangeResponse(layer_begin=slice_pb2.LayerBegin(contour_loops=loops))

        def piece(loop, first, points, last):
            message = slice_pb2.SliceRangeResponse()
            message.contour_chunk.pieces.add(loop=loop, first_point=first, last=last, points_mm=2 * points * [0.0])
            return message

        def objection(*messages):
            return self.objection(layers.Assembler(self.header(loops_only=True)), messages)

        self.assertEqual(objection(begin(1), piece(0, 0, 2, False), piece(0, 2, 1, True)), "")
        self.assertIn("than announced", objection(begin(0), piece(0, 0, 1, False)))
        self.assertIn("than announced", objection(begin(1), piece(0, 0, 1, True), piece(1, 0, 1, False)))
        self.assertIn("no contour points", objection(begin(1), piece(0, 0, 0, False)))
        self.assertIn("an empty chunk", objection(begin(1), slice_pb2.SliceRangeResponse(contour_chunk={})))
        self.assertIn("than there can be", objection(begin(1 << 60)))
        with mock.patch.object(layers, "_MOST_CONTOUR_POINTS", 20):
            self.assertEqual(objection(begin(1), piece(0, 0, 10, False), piece(0, 10, 1, True)), "")
            self.assertIn("than there can be", objection(begin(1), piece(0, 0, 10, False), piece(0, 10, 10, False)))
            self.assertIn("than there can be", objection(begin(4), piece(0, 0, 1, True), piece(1, 0, 10, True)))

    def test_surfaces(self):
        def header(vertices, triangles):
            head = surface_pb2.TessellationHeader(vertex_count=vertices, triangle_count=triangles)
            return surface_pb2.TessellateBoundaryResponse(header=head)

        def vertices(first, count):
            chunk = surface_pb2.VertexChunk(first_vertex=first, positions_mm=3 * count * [0.0])
            return surface_pb2.TessellateBoundaryResponse(vertex_chunk=chunk)

        def triangles(first, count):
            chunk = surface_pb2.TriangleChunk(first_triangle=first, vertices=count * [0, 1, 2])
            return surface_pb2.TessellateBoundaryResponse(triangle_chunk=chunk)

        def endless(first, message):
            """What a client that goes on reading dies of."""
            yield from first
            for _ in range(1_000):
                yield message
            self.fail("it went on")

        surface = ccslice.client._surface([header(3, 2), vertices(0, 2), vertices(2, 1), triangles(0, 1), triangles(1, 1)])
        self.assertEqual((surface.points_mm.shape, surface.triangles.shape), ((3, 3), (2, 3)))
        whole = [header(3, 1), vertices(0, 3)]
        for first, message in (([], vertices(0, 1)), (whole, vertices(3, 1)), (whole[:1], vertices(0, 4)),
                               (whole[:1], vertices(0, 0)), (whole, triangles(0, 0)), (whole, triangles(0, 2)),
                               ([*whole, triangles(0, 1)], triangles(1, 1)), (whole[:1], whole[0]),
                               ([], surface_pb2.TessellateBoundaryResponse()), ([], header((1 << 64) - 1, 1))):
            with self.assertRaises(ccslice.AnswerError):
                ccslice.client._surface(endless(first, message))
        bad = [header(3, 1), vertices(0, 3), surface_pb2.TessellateBoundaryResponse(triangle_chunk={"vertices": [0, 1, 3]})]
        with self.assertRaises(ccslice.AnswerError):
            ccslice.client._surface(bad)

    def test_pictures(self):
        def begin(**options):
            head = {"width": 2, "height": 1, "picture_bytes": 8, **options}
            return preview_pb2.PreviewResponse(number=1, stage=preview_pb2.PREVIEW_STAGE_FULL, header=head)

        def part(**options):
            return preview_pb2.PreviewResponse(number=1, stage=preview_pb2.PREVIEW_STAGE_FULL, **options)

        def objection(*messages):
            return self.objection(preview.PreviewAssembler(), messages)

        self.assertEqual(objection(begin(), part(picture=bytes(8)), part(outlines=[{"points_mm": 4 * [0.0]}], last=True)), "")
        self.assertIn("longer than announced", objection(begin(), part(picture=bytes(9))))
        self.assertIn("nothing in them", objection(begin(), part(picture=b"a"), part(), part()))
        self.assertIn("impossible size", objection(begin(width=2049)))
        self.assertIn("impossible size", objection(begin(picture_bytes=9)))
        self.assertIn("inside another one", objection(begin(), begin()))
        self.assertIn("another picture", objection(begin(), preview_pb2.PreviewResponse(number=2, picture=b"a")))
        with mock.patch.object(preview, "_MOST_OUTLINE_POINTS", 100):
            self.assertIn("outlines", objection(begin(), part(outlines=2 * [{"points_mm": 100 * [0.0]}])))
            self.assertIn("outlines", objection(begin(), part(outlines=30 * [{}])))


class LyingServers(unittest.TestCase):
    """Servers whose calls answer what a test says."""

    def client_of(self, answers, **options):
        """answers: of a method's name, what its calls give, messages or bytes; or a function of request and context."""
        self.calls = []

        class Handler(grpc.GenericRpcHandler):
            def service(handler, details):
                answer = answers[details.method.rpartition("/")[2]]

                def give(request, context):
                    self.calls.append(details.method)
                    for message in answer(request, context) if callable(answer) else answer:
                        yield message if isinstance(message, bytes) else message.SerializeToString()

                return grpc.stream_stream_rpc_method_handler(give)

        server = grpc.server(futures.ThreadPoolExecutor(4), handlers=[Handler()],
                             options=[("grpc.max_send_message_length", -1)])
        self.addCleanup(lambda: server.stop(0))
        port = server.add_insecure_port("127.0.0.1:0")
        server.start()
        client = ccslice.Client(f"127.0.0.1:{port}", **options)
        self.addCleanup(client.close)
        return client

    def test_compressed_answers_are_refused_and_never_inflated(self):
        for size in (100, 100_000, 100_000_000):
            def compressed(_, context):
                context.set_compression(grpc.Compression.Gzip)
                yield info_pb2.GetServerInfoResponse(engine_version=size * "e")

            begin = time.monotonic()
            with self.assertRaisesRegex(ccslice.AnswerError, "compressed"):
                self.client_of({"GetServerInfo": compressed}, patience_s=20).server_info()
            self.assertLess(time.monotonic() - begin, 10)

    def test_servers_are_told_not_to_compress(self):
        with socket.create_server(("127.0.0.1", 0)) as listener, \
                ccslice.Client(f"127.0.0.1:{listener.getsockname()[1]}", local=False, patience_s=0.1) as client:
            caller = threading.Thread(target=lambda: self.assertRaises(ccslice.CallError, client.server_info))
            caller.start()
            connection, _ = listener.accept()
            connection.sendall(bytes(3) + b"\4" + bytes(5))  # SETTINGS, without any.
            connection.settimeout(10)
            sent = b""
            while b"GetServerInfo" not in sent or b"user-agent" not in sent:
                sent += connection.recv(65536)
            connection.close()
            caller.join()
        self.assertIn(b"grpc-accept-encoding\x08identity", sent)
        self.assertNotIn(b"gzip", sent)

    def test_answers_that_are_no_messages_are_refused_at_once(self):
        begin = time.monotonic()
        with self.assertRaises(ccslice.AnswerError):
            self.client_of({"GetServerInfo": [b"\x1f"]}, patience_s=20).server_info()
        self.assertLess(time.monotonic() - begin, 10)

    def test_messages_are_of_bounded_size(self):
        with self.assertRaisesRegex(ccslice.CallError, "larger than max"):
            self.client_of({"GetServerInfo": [bytes(64 << 20)]}).server_info()

    def test_details_that_are_no_message_count_as_none(self):
        def refuse(_, context):
            context.set_trailing_metadata((("grpc-status-details-bin", b"\x1f"),))
            context.abort(grpc.StatusCode.INVALID_ARGUMENT, "wrong")

        with self.assertRaisesRegex(ccslice.CallError, "wrong"):
            self.client_of({"GetServerInfo": refuse}).server_info()

    def test_points_have_one_answer_each(self):
        right = points_pb2.ProbePointsResponse(locations=[0], limit_cells=[0], control_cells=[0], residuals_mm=[0],
                                               uvw=3 * [0])
        mesh = ccslice.Mesh(CORNERS, HEXAHEDRON)
        info = info_pb2.GetServerInfoResponse(max_points_per_message=4096)
        upload = mesh_pb2.UploadMeshResponse()

        def probed(answers, info=info):
            given = {"GetServerInfo": [info], "UploadMesh": [upload], "ProbePoints": answers}
            return self.client_of(given).probe(mesh, [[1, 2, 3]])

        self.assertEqual(len(probed([right]).inside), 1)
        more = points_pb2.ProbePointsResponse(channel_values=[0])
        more.MergeFrom(right)
        for answers in ([], [right, right], [points_pb2.ProbePointsResponse()], [more], itertools.repeat(right)):
            with self.assertRaises(ccslice.AnswerError):
                probed(answers)
        with self.assertRaises(ccslice.AnswerError):
            probed([right], info_pb2.GetServerInfoResponse())

    def test_a_mesh_that_is_always_lost_is_not_uploaded_for_ever(self):
        mesh = cube()

        def lost(request, context):
            message = slice_pb2.SliceRangeResponse()
            message.header.mesh_ids.append(mesh.id)
            message.header.layer_count = 1
            message.header.planes.add(encoding=job_pb2.PLANE_ENCODING_RAW, sample_type=job_pb2.SAMPLE_TYPE_BIT)
            message.header.planes[0].occupancy.SetInParent()
            yield message
            context.set_trailing_metadata((("grpc-status-details-bin", missing_mesh(mesh.id)),))
            context.abort(grpc.StatusCode.FAILED_PRECONDITION, "it isn't here")

        client = self.client_of({"UploadMesh": [mesh_pb2.UploadMeshResponse()], "SliceRange": lost,
                                 "PlanSlices": [plan_pb2.PlanSlicesResponse(layer_count=1)]})
        client._stub.SliceRange = with_raw_planes(client._stub.SliceRange)
        with self.assertRaises(ccslice.CallError) as caught:
            list(client.slice(mesh, 1))
        self.assertEqual(caught.exception.missing_mesh_id, mesh.id)
        self.assertLess(len(self.calls), 20)


class LongJobs(unittest.TestCase):
    """Servers that go and come back."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def server_at(self, address):
        """A server on a port of its own, which another one may take over."""
        process = subprocess.Popen([CCSLICED, "--listen", address, "--log-level", "error"])
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def test_a_job_goes_on_after_its_server_is_killed(self):
        with Server(CCSLICED, pathlib.Path(self.folder.name)) as found:
            address = found.address()  # A free port, which is left again.
        servers = [self.server_at(address)]
        # A megabyte a layer: more than what is under way when a server dies.
        mesh, job = cube(), {"channels": ["g"], "layers": range(300)}
        with ccslice.Client(address) as client:
            whole = [zlib.crc32(layer.channels["g"]) for layer in client.slice(mesh, 0.02, **job)]
            got, streams, killed, open_stream = [], [], 0, client._stub.SliceRange
            client._stub.SliceRange = lambda request: streams.append(request.first_layer) or open_stream(request)
            for layer in client.slice(mesh, 0.02, **job):
                self.assertEqual(layer.index, len(got))
                got.append(zlib.crc32(layer.channels["g"]))
                # The first server at once, and the second one as soon as it has given a layer.
                if len(servers) == killed + 1 and (killed == 0 or (killed == 1 and streams[-1] > 0)):
                    servers[-1].kill()
                    servers[-1].wait()
                    killed += 1
                    again = threading.Timer(0.5, lambda: servers.append(self.server_at(address)))
                    again.start()
                    self.addCleanup(again.join)
        self.assertEqual(len(servers), 3)
        self.assertGreater(len({first for first in streams}), 2, "streams that begin where another one broke")
        self.assertEqual(got, whole)

    def test_a_server_that_has_dropped_the_mesh_gets_it_again(self):
        with Server(CCSLICED, pathlib.Path(self.folder.name)) as server, ccslice.Client(server.address()) as client, \
                ccslice.Client(server.address()) as other:
            mesh = cube()
            client.upload(mesh)
            self.assertTrue(other.delete(mesh))
            self.assertEqual(len(list(client.slice(mesh, 2))), 5)
            self.assertTrue(client.delete(mesh))
            with self.assertRaises(ccslice.CallError) as caught:
                client.plan(mesh.id, 1)
            self.assertEqual(caught.exception.missing_mesh_id, mesh.id)

    def test_a_standing_connection_whose_calls_fail_is_asked_with_pauses(self):
        calls = []

        class Refusing(grpc.GenericRpcHandler):
            def service(self, details):
                def refuse(_, context):
                    calls.append(details.method)
                    context.abort(grpc.StatusCode.UNAVAILABLE, "a proxy without a server")

                return grpc.unary_unary_rpc_method_handler(refuse)

        proxy = grpc.server(futures.ThreadPoolExecutor(2), handlers=[Refusing()])
        port = proxy.add_insecure_port("127.0.0.1:0")
        proxy.start()
        with ccslice.Client(f"127.0.0.1:{port}", patience_s=1.5) as client:
            with self.assertRaises(ccslice.CallError):
                client.server_info()
        proxy.stop(0)
        self.assertGreater(len(calls), 1)
        self.assertLess(len(calls), 10)

    def test_patience_begins_with_the_first_failure(self):
        class Broken(grpc.RpcError):
            code = staticmethod(lambda: grpc.StatusCode.UNAVAILABLE)
            details = staticmethod(lambda: "the connection broke")
            trailing_metadata = staticmethod(lambda: ())

        def breaking(request):
            """A stream that breaks after its first layer, if that is the job's."""
            for message in right(request):
                yield message
                if message.WhichOneof("event") == "layer_end" and message.layer_end.layer == 0:
                    raise Broken()

        real, passed, firsts = time.monotonic, 0, []
        with ccslice.Client(local=True, patience_s=60) as client, \
                mock.patch("ccslice.client.time.monotonic", lambda: real() + passed):
            right = client._stub.SliceRange
            client._stub.SliceRange = lambda request: firsts.append(request.first_layer) or Stream(breaking(request))
            for layer in client.slice(cube(), 2):
                passed += 90 if layer.index == 0 else 0  # What a caller does with a layer may take longer.
        self.assertEqual(firsts, [0, 1])

    def test_patience_bounds_the_pause_that_a_server_asks_for(self):
        calls, delay = [], b""

        class Busy(grpc.GenericRpcHandler):
            def service(self, details):
                def refuse(_, context):
                    calls.append(details.method)
                    context.set_trailing_metadata((("grpc-status-details-bin", busy_for(*delay)),))
                    context.abort(grpc.StatusCode.UNAVAILABLE, "busy")

                return grpc.unary_unary_rpc_method_handler(refuse)

        busy = grpc.server(futures.ThreadPoolExecutor(2), handlers=[Busy()])
        self.addCleanup(lambda: busy.stop(0))
        port = busy.add_insecure_port("127.0.0.1:0")
        busy.start()
        most, most_nanos = (1 << 63) - 1, (1 << 31) - 1
        for delay, told in (((-most, -most_nanos), 0), ((0, -most_nanos), 0), ((1, -500_000_000), 0.5),
                            ((0, most_nanos), 2.147483647), ((3600, 1), 3600), ((10_000_000_000, 0), 3600),
                            ((most, most_nanos), 3600)):
            calls.clear()
            begin = time.monotonic()
            with self.subTest(delay), ccslice.Client(f"127.0.0.1:{port}", patience_s=0.3) as client:
                with self.assertRaises(ccslice.CallError) as caught:
                    client.server_info()
                self.assertAlmostEqual(caught.exception.retry_delay_s, told)
                self.assertLess(len(calls), 5)
            self.assertLess(time.monotonic() - begin, 3)

    def test_patience_runs_out(self):
        begin = time.monotonic()
        with ccslice.Client("127.0.0.1:1", patience_s=0.5) as client:
            with self.assertRaises(ccslice.CallError):
                client.server_info()
        self.assertLess(time.monotonic() - begin, 5)

    def test_a_long_wait_is_told_once(self):
        with mock.patch("ccslice.client._SILENT_S", 0.3), ccslice.Client("127.0.0.1:1", patience_s=1.5) as client:
            with self.assertLogs("ccslice", "WARNING") as log, self.assertRaises(ccslice.CallError):
                client.server_info()
        self.assertEqual(len(log.output), 1)
        self.assertRegex(log.output[0], r"127\.0\.0\.1:1.*; trying for another [12] s \(patience_s\)")


class Connections(unittest.TestCase):
    """What goes with calls, as a server sees it that knows none of them."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.seen = seen = []

        class Handler(grpc.GenericRpcHandler):
            def service(self, handler_call_details):
                seen.append((handler_call_details.method.split("/")[-1], dict(handler_call_details.invocation_metadata)))

        self.server = grpc.server(futures.ThreadPoolExecutor(2))
        self.server.add_generic_rpc_handlers((Handler(),))
        self.addCleanup(lambda: self.server.stop(None).wait())

    def serve(self, credentials=None):
        """The port."""
        add = self.server.add_secure_port if credentials else self.server.add_insecure_port
        port = add("localhost:0", *([credentials] if credentials else []))
        self.server.start()
        return port

    def token(self, content):
        path = self.folder / "token"
        path.write_bytes(content)
        return str(path)

    def refused(self, call):
        with self.assertRaises(ccslice.CallError) as caught:
            call()
        self.assertEqual(caught.exception.code, grpc.StatusCode.UNIMPLEMENTED)

    def test_calls_name_their_mesh_and_carry_the_token(self):
        with ccslice.Client(f"localhost:{self.serve()}", token_file=self.token(b"s3cret\nand more\n")) as client:
            self.refused(client.server_info)
            self.refused(lambda: client.upload(cube()))
            self.refused(lambda: client.tessellate(cube()))
            self.refused(lambda: client.delete("no id"))
            self.refused(lambda: list(client.preview(cube(), [], 0.1)))
        self.assertEqual([method for method, _ in self.seen],
                         ["GetServerInfo", "UploadMesh", "TessellateBoundary", "DeleteMesh", "Preview"])
        self.assertEqual({metadata["authorization"] for _, metadata in self.seen}, {"Bearer s3cret"})
        self.assertEqual([metadata.get("ccslice-mesh-id") for _, metadata in self.seen],
                         [None, cube().id, cube().id, None, cube().id])

    def test_files_without_a_token_are_named_and_not_shown(self):
        for content in (b"", b"\ns3cret", b"s3cret of words", b"s3cr\xc3\xa9t", b"s" * 4097):
            with self.assertRaises(ValueError) as caught:
                ccslice.Client("localhost:1", token_file=self.token(content))
            self.assertIn(str(self.folder / "token"), str(caught.exception))
            self.assertNotIn("s3cr", str(caught.exception))
        with self.assertRaises(FileNotFoundError):
            ccslice.Client("localhost:1", token_file=str(self.folder / "nowhere"))

    def test_tls(self):
        ca, key = str(self.folder / "ca.pem"), str(self.folder / "ca.key")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                        "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost", "-keyout", key, "-out", ca],
                       check=True, capture_output=True)
        pair = (pathlib.Path(key).read_bytes(), pathlib.Path(ca).read_bytes())
        port = self.serve(grpc.ssl_server_credentials([pair], pair[1], require_client_auth=True))
        for address in (f"localhost:{port}", f"https://localhost:{port},localhost:1"):
            with ccslice.Client(address, ca=ca, cert=ca, key=key) as client:
                self.refused(client.server_info)
        with mock.patch.dict(os.environ, {"CCSLICE_CA": ca}), ccslice.Client(f"localhost:{port}", patience_s=0.2) as client:
            with self.assertRaises(ccslice.CallError):
                client.server_info()
        self.assertEqual(len(self.seen), 2)
        with self.assertRaises(ValueError):
            ccslice.Client("localhost:1", cert=ca)


class Proxies(unittest.TestCase):
    """gRPC goes through the proxy that the environment names. Nobody listens at this one."""

    def test_this_machine_is_reached_without_one(self):
        with tempfile.TemporaryDirectory() as folder, Server(CCSLICED, pathlib.Path(folder)) as server:
            for name in ("grpc_proxy", "https_proxy", "http_proxy"):
                with mock.patch.dict(os.environ, {name: "http://127.0.0.1:1"}):
                    address = server.address()
                    for own in (address, address.replace("127.0.0.1", "localhost"), "ipv4:" + address):
                        with ccslice.Client(own, patience_s=5) as client:
                            self.assertGreater(client.server_info().threads, 0)

    def test_which_addresses_are_this_machines(self):
        for own in ("localhost:1", "LOCALHOST.:1", "127.3.2.1:1", "[::1]:1", "[::ffff:127.0.0.1]:1",
                    "unix:/x", "unix-abstract:x", "dns:///localhost:1", "dns:localhost", "ipv4:127.0.0.1:1,127.0.0.2:1"):
            self.assertTrue(connection.is_loopback(own), own)
        for other in ("slicer:1", "127.example:1", "localhost.example:1", "a.localhost:1", "10.0.0.1:1", "[fe80::1]:1", "xds:localhost",
                      "ipv4:127.0.0.1:1,10.0.0.1:1", "dns://localhost/slicer:1"):
            self.assertFalse(connection.is_loopback(other), other)

    def test_one_on_the_way_is_named(self):
        for variables, named in (({"http_proxy": "http://127.0.0.1:1"}, True),
                                 ({"http_proxy": "http://127.0.0.1:1", "no_proxy": "a,.invalid"}, False),
                                 ({"grpc_proxy": "", "http_proxy": "http://127.0.0.1:1"}, False)):
            with mock.patch.dict(os.environ, variables), ccslice.Client("slicer.invalid:1", patience_s=0) as client:
                with self.assertRaises(ccslice.CallError) as caught:
                    client.server_info()
                self.assertEqual("the environment's http_proxy names" in str(caught.exception), named)


class LocalServers(unittest.TestCase):
    """Servers that clients start for themselves."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.temporary = folder.name
        self.environment = {key: value for key, value in os.environ.items() if key != "CCSLICE_SERVER"}
        self.environment["TMPDIR"] = self.temporary

    def python(self, code, **environment):
        return subprocess.run([sys.executable, "-c", code], env={**self.environment, **environment}, text=True,
                              capture_output=True)

    def test_two_at_once_end_with_their_clients(self):
        before = os.environ.get("TMPDIR")
        os.environ["TMPDIR"] = self.temporary
        try:
            with ccslice.Client(local=True) as one, ccslice.Client(local=True) as other:
                self.assertNotEqual(one.address, other.address)
                self.assertEqual(len(private_folders(self.temporary)), 2)
                self.assertEqual(one.server_info().engine_version, other.server_info().engine_version)
                release, own = one.server_info().server_version.split("+")[0], ccslice.__version__.split("+")[0]
                self.assertEqual(release, own)
        finally:
            os.environ.pop("TMPDIR") if before is None else os.environ.__setitem__("TMPDIR", before)
        self.assertEqual(private_folders(self.temporary), [])

    def test_none_is_left_when_the_client_is_killed(self):
        code = "import ccslice, time; c = ccslice.Client(local=True); print(c.address, flush=True); time.sleep(60)"
        client = subprocess.Popen([sys.executable, "-c", code], env=self.environment, stdout=subprocess.PIPE)
        client.stdout.readline()
        self.assertEqual(len(private_folders(self.temporary)), 1)
        client.send_signal(signal.SIGKILL)
        client.wait()
        client.stdout.close()
        self.assertTrue(comes_true(lambda: private_folders(self.temporary) == []))

    def test_programs_that_arent_the_server_are_named(self):
        code = "import ccslice; ccslice.Client(local=True)"
        for program, text in (("/nonexistent", "can't be started"), ("/bin/false", "another version")):
            result = self.python(code, CCSLICED=program)
            self.assertIn(f"LocalServerError: {program}", result.stderr)
            self.assertIn(text, result.stderr)

    def test_without_grpcio_the_remedy_is_said(self):
        blocked = pathlib.Path(self.temporary) / "grpc.py"
        blocked.write_text("raise ImportError('not there')\n")
        result = self.python("import ccslice", PYTHONPATH=f"{self.temporary}:{os.environ['PYTHONPATH']}")
        self.assertIn("ccslice needs grpcio: apt-get install python3-grpcio", result.stderr)
        self.assertNotIn("not there", result.stderr)


class Previews(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.client = ccslice.Client(local=True)
        cls.mesh = ccslice.Mesh(CORNERS, HEXAHEDRON, channels={"x": CORNERS[:, 0]}, sharp_edges=EDGES,
                                sharp_vertices=range(8))

    @classmethod
    def tearDownClass(cls):
        cls.client.close()

    def test_a_cut_through_a_cube_is_a_square(self):
        planes = [ccslice.Plane((5, 5, z)) for z in (2, 5, 50)]
        pictures = list(self.client.preview(self.mesh, planes, 0.25, size=(64, 48), every=True, contours=True))
        self.assertEqual([picture.number for picture in pictures], [1, 2, 3])
        self.assertEqual(pictures[0].rgba.shape, (48, 64, 4))
        self.assertEqual([int((picture.rgba[..., 3] > 0).sum()) for picture in pictures], [1600, 1600, 0])
        self.assertTrue((pictures[1].rgba[4:44, 12:52, 3] == 255).all())
        (square,) = pictures[1].outlines
        self.assertTrue(np.allclose(square.min(axis=0), (3, 1)) and np.allclose(square.max(axis=0), (13, 11)))

    def test_channels_go_from_left_to_right(self):
        (picture,) = self.client.preview(self.mesh, [ccslice.Plane((5, 5, 5))], 0.25, size=(40, 40), channel="x",
                                         colours="grey", value_range=(0, 10))
        row = picture.rgba[20, :, 0].astype(int)
        self.assertTrue((np.diff(row) >= 0).all())
        self.assertAlmostEqual(row[0], 255 * 0.0125, delta=2)
        self.assertEqual(picture.value_range, (0, 10))

    def test_lines_are_drawn_on_top_and_values_counted(self):
        planes, options = [ccslice.Plane((5, 5, 5))], {"size": (64, 48), "channel": "x", "value_range": (0, 10)}
        (plain,) = self.client.preview(self.mesh, planes, 0.25, **options)
        (lined,) = self.client.preview(self.mesh, planes, 0.25, lines=4, **options)
        self.assertEqual(sum(lined.value_pixels), 1600)
        self.assertEqual(lined.value_pixels, plain.value_pixels)
        differs = (plain.rgba != lined.rgba).any(axis=2)
        self.assertTrue(differs[2:6, 14:50].all() and (lined.rgba[2:6, 14:50] == (0, 0, 0, 255)).all())
        self.assertFalse(differs[8:40, 16:48].any() or differs[:1].any())
        with self.assertRaisesRegex(ccslice.CallError, "lines"):
            list(self.client.preview(self.mesh, planes, 0.25, lines=99))

    def test_coarse_pictures_come_first_and_the_latest_plane_wins(self):
        planes = [ccslice.Plane((5, 5, 5), (1, 2, 0.01 * step)) for step in range(200)]
        pictures = list(self.client.preview(self.mesh, planes, 0.25, coarse=True))
        self.assertTrue(pictures[0].coarse)
        self.assertEqual((pictures[-1].number, pictures[-1].coarse), (200, False))
        self.assertLess(len(pictures), 400)

    def test_mixes_are_shown_and_wrong_arguments_named(self):
        printing = ccslice.Printing({"a": "#ff0000", "b": "#0000ff"}, ccslice.blend("x", {0: "a", 10: "b"}))
        (picture,) = self.client.preview(self.mesh, [ccslice.Plane((5, 5, 5))], 0.25, size=(40, 40), printing=printing)
        self.assertGreater(picture.rgba[20, 1, 0], picture.rgba[20, 38, 0])
        for arguments, text in (({"colours": "jet", "channel": "x"}, "colours"), ({"channel": "y"}, "has no channel")):
            with self.assertRaisesRegex((ValueError, ccslice.CallError), text):
                list(self.client.preview(self.mesh, [ccslice.Plane((5, 5, 5))], 0.25, **arguments))
        with self.assertRaisesRegex(ValueError, "normal"):
            list(self.client.preview(self.mesh, [ccslice.Plane((0, 0, 0), (0, 0, 0))], 0.25))


class Package(unittest.TestCase):
    def test_the_example_of_the_readme_runs_from_a_wheel(self):
        pages = [(REPOSITORY / page).read_text() for page in ("README.md", "client/python/README.md")]
        example, same = (re.search(r"```python\n(.*?)```", page, re.DOTALL).group(1) for page in pages)
        self.assertEqual(example, same)
        with tempfile.TemporaryDirectory() as folder:
            pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--no-cache-dir"]
            # A copy, so that building leaves nothing in the checkout.
            subprocess.run(["cp", "-r", "--parents", "client/python", "proto", "cmake/version.sh", "VERSION", f"{folder}"], check=True, cwd=REPOSITORY)
            source = pathlib.Path(folder) / "client/python"
            subprocess.run([*pip, "wheel", "--no-build-isolation", "--no-deps", "-w", f"{folder}/wheels", str(source)],
                           check=True)
            wheel = next(pathlib.Path(folder).glob("wheels/*.whl"))
            release = (REPOSITORY / "VERSION").read_text().strip()  # The copy has no history that says more.
            self.assertEqual(wheel.name, f"ccslice-{release}-py3-none-any.whl")
            subprocess.run([*pip, "install", "--no-deps", "--root-user-action=ignore", "--target", f"{folder}/site", str(wheel)], check=True)
            environment = {**os.environ, "PYTHONPATH": f"{folder}/site"}
            result = subprocess.run([sys.executable, "-c", example], env=environment, cwd=folder, text=True,
                                    capture_output=True)
            self.assertEqual(result.returncode, 0, result.stderr)
            shape, share = re.match(r"(\(.*\)) (\S+)", result.stdout).groups()
            self.assertEqual(len(json.loads(shape.replace("(", "[").replace(")", "]"))), 3)
            self.assertAlmostEqual(float(share), 0.5, delta=0.02)


if __name__ == "__main__":
    unittest.main()

# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Calls of a ccslice server."""

import inspect
import logging
import os
import random
import threading
import time
import warnings
from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple, TypeVar, Union

import grpc
import numpy as np

from .arguments import floats, number_pair, pair, triple, whole_numbers
from .connection import Calls, Identity, is_mesh_id, proxy_hint
from .errors import AnswerError, CallError, PlanWarning, call_error, require_answer
from .fields import Fields, TakenFields, add_fields, taken
from .layers import Assembler, Layer
from .local_server import LocalServer
from .mesh import Mesh
from .parts import Part
from .points import Evaluation, Probe
from .preview import Plane, Preview, PreviewAssembler, content_message, plane_message
from .printing import Printing, material_map
from .surface import Surface
from .v1 import info_pb2, job_pb2, mesh_pb2, plan_pb2, points_pb2, preview_pb2, slice_pb2, surface_pb2
from .volume import Volume

_LOG = logging.getLogger("ccslice")
_DEFAULT_ADDRESS = "localhost:50051"
_CHUNK_BYTES = 1 << 20
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.2, 10.0
_SILENT_S = 3.0  # Of an attempt that goes on: whoever waits longer wants to know for what.
_AT_ONCE_S = 0.05  # What a connection that stands takes to say so.
_ASK_EVERY_S, _LONGEST_ANSWER_S = 0.5, 5.0  # Of how far a mesh is.
_MOST_REUPLOADS = 3  # In a row: a server that keeps losing what it has just taken.
_MOST_SURFACE_BYTES = 8 << 30
_SAMPLE_TYPES = {
    "uint8": job_pb2.SAMPLE_TYPE_UINT8,
    "uint16": job_pb2.SAMPLE_TYPE_UINT16,
    "float32": job_pb2.SAMPLE_TYPE_FLOAT32,
}

Pitch = Union[float, Sequence[float]]
Channels = Union[Iterable[str], Mapping[str, Any]]
_OVERLAPS = {"priority": job_pb2.PART_OVERLAPS_UNSPECIFIED, "refuse": job_pb2.PART_OVERLAPS_REFUSE}
Meshes = Union[Mesh, str, Sequence[Part], job_pb2.SliceJob]
OnPreparation = Callable[[mesh_pb2.GetPreparationResponse], None]
Result = TypeVar("Result")


def _has_zstandard() -> bool:
    try:
        import zstandard  # noqa: F401
    except ImportError:
        return False
    return True


def _triple(name: str, value: Any) -> Tuple[float, float, float]:
    numbers = triple(name, value, or_one=name == "pitch")
    return float(numbers[0]), float(numbers[1]), float(numbers[2])


def _counts(name: str, value: Any) -> Tuple[int, int, int]:
    numbers = triple(name, value)
    if not np.isfinite(numbers).all() or not np.array_equal(numbers, np.floor(numbers)):
        raise ValueError(f"{name} takes whole numbers, not {value!r}")
    return int(numbers[0]), int(numbers[1]), int(numbers[2])


def _points(name: str, points: Any) -> np.ndarray:
    array = floats(name, points, "numbers of shape (n, 3)")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must have shape (n, 3), not {array.shape}")
    return array


def _checked_layers(layers: Any) -> Optional[range]:
    """Two numbers could be the last layer or the one behind it, so they are refused."""
    if layers is None:
        return None
    if not isinstance(layers, range):
        raise ValueError(f"layers takes a range, such as range(0, 10) for layers 0 to 9, not {layers!r}")
    if layers.step != 1 or len(layers) == 0 or layers[0] < 0:
        raise ValueError(f"layers takes a range of step 1, from 0 on, that isn't empty, not {layers}")
    return layers


class _Attempts:
    """Counts what failed since a call last got somewhere, and waits before the next attempt."""

    def __init__(self, channel: grpc.Channel, patience_s: float):
        self._channel = channel
        self._patience_s = patience_s
        self.progress()

    def progress(self) -> None:
        self._failures = 0
        self._reuploads: Dict[str, int] = {}  # By mesh.
        self._is_told = False

    def count_reupload(self, error: CallError) -> None:
        """A mesh that is at hand is missing. Raises the error if that comes too often."""
        times = self._reuploads.get(error.missing_mesh_id, 0) + 1
        self._reuploads[error.missing_mesh_id] = times
        if times > _MOST_REUPLOADS:
            raise error

    def wait_after(self, error: CallError) -> None:
        """Raises the error if it won't pass, or if patience has run out."""
        if not error.passes:
            raise error
        if self._failures == 0:
            self._since = time.monotonic()  # Whatever the caller does with a layer takes its time.
        left = self._since + self._patience_s - time.monotonic()
        pause = min(_FIRST_PAUSE_S * 2**min(self._failures, 20), _LONGEST_PAUSE_S) * random.uniform(0.75, 1.25)
        pause = max(pause, error.retry_delay_s or 0)
        self._failures += 1
        begin = time.monotonic()
        if not self._is_told and left > 0 and begin + pause - self._since > _SILENT_S:
            self._is_told = True
            _LOG.warning("%s; trying for another %.0f s (patience_s)", error, left)
        if left > 0 and not error.reason and self._wait_for_connection(min(pause, left)):
            # Where nobody answered, whoever is back is used at once. A connection that stood all the time while calls
            # fail is a proxy's.
            if time.monotonic() - begin > _AT_ONCE_S:
                return
        pause -= time.monotonic() - begin
        if begin + pause - self._since > self._patience_s:
            raise error
        time.sleep(max(0, pause))

    def _wait_for_connection(self, seconds: float) -> bool:
        ready = grpc.channel_ready_future(self._channel)
        try:
            ready.result(timeout=seconds)
            return True
        except grpc.FutureTimeoutError:
            return False
        finally:
            ready.cancel()


def _first_mesh(job: job_pb2.SliceJob) -> str:
    return job.parts[0].mesh_id if job.parts else ""


class Client:
    """A connection to a server. A context manager: close() ends it, and a server that was started for it.

    address: "HOST:PORT", "https://HOST:PORT" for TLS, or "unix:PATH"; of several with commas between them the first.
        Default: the environment variable CCSLICE_SERVER, or localhost:50051; where neither variable nor address is given
        and nobody answers there, a ccsliced of our own is started.
    local: True starts one in any case, False never.
    patience_s: how long a call that can be repeated goes on after a failure without getting anywhere.
    ca, cert, key: PEM files for TLS: whose signatures count, and the client's own certificate, for servers that ask.
    token_file: a file whose first line goes with every call as a bearer token. Default for these four: the environment
        variables CCSLICE_CA, CCSLICE_CERT, CCSLICE_KEY and CCSLICE_TOKEN_FILE.

    A server that has lost a mesh gets it again. A stream that breaks goes on with the first layer not delivered. All
    methods raise CallError, and AnswerError for damaged answers.
    """

    def __init__(self, address: Optional[str] = None, *, local: Optional[bool] = None, patience_s: float = 120.0,
                 ca: Optional[str] = None, cert: Optional[str] = None, key: Optional[str] = None,
                 token_file: Optional[str] = None):
        if address is not None and local:
            raise ValueError("local=True starts a server, so it goes with no address")
        self._patience_s = patience_s
        self._identity = Identity(ca, cert, key, token_file)
        self._meshes: Dict[str, Union[Mesh, Volume]] = {}  # The server may ask for them again.
        self._server: Optional[LocalServer] = None
        chosen = address or os.environ.get("CCSLICE_SERVER", "")
        if local:
            self._server = LocalServer()
        self._open(self._server.address if self._server else chosen or _DEFAULT_ADDRESS)
        if self._server is None and not chosen and local is None and not self._answers():
            self._channel.close()
            self._server = LocalServer()
            self._open(self._server.address)

    def _open(self, address: str) -> None:
        self.address = address
        self._channel = self._identity.channel(address)
        # A server of our own is reached by nobody else, and asks for no token.
        self._stub = Calls(self._channel, [] if self._server else self._identity.metadata())
        self._info: Optional[info_pb2.GetServerInfoResponse] = None

    def _answers(self) -> bool:
        try:
            self._stub.GetServerInfo(info_pb2.GetServerInfoRequest())
        except grpc.RpcError as error:
            return error.code() != grpc.StatusCode.UNAVAILABLE or bool(call_error(error).reason)
        return True

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection, and the server if it was started for it."""
        self._channel.close()
        if self._server is not None:
            self._server.close()
            self._server = None

    def server_info(self) -> info_pb2.GetServerInfoResponse:
        """Versions, limits and printers of the server: the contract's message."""
        if self._info is None:
            self._info = self._call(lambda: self._stub.GetServerInfo(info_pb2.GetServerInfoRequest()))
        return self._info

    def upload(self, mesh: Mesh, *, on_preparation: Optional[OnPreparation] = None) -> mesh_pb2.MeshSummary:
        """What the server knows about a mesh, which it gets unless it holds it: cells, box, volumes, folds.

        on_preparation: called about twice a second while the server prepares the mesh, with its phase and the cells
            that are done of it (the contract's GetPreparationResponse), if they are further than before; an upload that
            is repeated may begin anew. Never, where the server is too old, or a proxy leads to another one. What it
            raises cancels the upload.
        """
        self._meshes[mesh.id] = mesh
        return self._call(lambda: self._upload_once(mesh, on_preparation))

    def delete(self, mesh: Union[Mesh, str]) -> bool:
        """Whether the server held it. It isn't uploaded again by itself."""
        mesh_id = mesh if isinstance(mesh, str) else mesh.id
        self._meshes.pop(mesh_id, None)
        return self._call(lambda: self._stub.DeleteMesh(mesh_pb2.DeleteMeshRequest(mesh_id=mesh_id))).deleted

    def plan(self, mesh: Meshes, pitch: Optional[Pitch] = None, **job: Any) -> plan_pb2.PlanSlicesResponse:
        """What slicing would give: grid, layers, sizes, warnings. Takes what slice() takes, but layers."""
        request = plan_pb2.PlanSlicesRequest(job=self.job(mesh, pitch, **job))
        return self._call(lambda: self._stub.PlanSlices(request), chosen_by=_first_mesh(request.job))

    def job(self, mesh: Meshes, pitch: Optional[Pitch] = None, **job: Any) -> job_pb2.SliceJob:
        """The job as the contract's message, which plan() and slice() take in place of a mesh. Takes what they take,
        but layers. google.protobuf.json_format writes it as a file that `ccslice slice --job` takes, and reads one.
        """
        if not isinstance(mesh, job_pb2.SliceJob):
            return self._job(mesh, pitch, **job)
        if pitch is not None or job:
            raise ValueError("a SliceJob says the whole job; leave out pitch and what else there is, or change the job")
        return mesh

    def slice(self, mesh: Meshes, pitch: Optional[Pitch] = None, *, layers: Optional[range] = None,
              on_progress: Optional[Callable[[int, int], None]] = None, **job: Any) -> Iterator[Layer]:
        """The layers, one after the other, as they come.

        mesh: a Mesh, or the id of an uploaded one; or a list of Parts; or a SliceJob, which says all but layers.
        pitch: of voxels in mm, three numbers or one for all; default: the printer's.
        layers: a range of them, counted in the grid, such as range(0, 10) for the first ten; default: all.
        channels: names, as float32; or {name: "uint8", "uint16" or "float32"}, integers over the channel's range.
        value_ranges: {channel: (low, high)} that integers stand for instead.
        fields: {name: a formula, a Field, a Volume, or an array of samples that fill the box round the part}, values
            that channels and printing then name like channels.
        cut: name of a channel or field; voxels where it is above 0.5 are as outside the part.
        outside: what channels hold outside the part, an integer as it is stored or a float; default: 0.
        occupancy: whether to say which voxels are inside; default: if nothing else is asked for.
        printing: a Printing, for one material in each voxel. cell_regions: whether to say the cell region of each.
        contours: whether layers have their outlines. contours_by_cell_region: those of each cell region instead.
        printer: a printer's name. origin_mm, extent: of the grid.
        placement: (3, 4) or (4, 4) matrix, row by row; Parts have their own.
        box_mm: ((x, y, z), (x, y, z)), only this box of it. overlaps: voxels in several parts are the first's
            or those of the highest "priority", or are an error, "refuse".
        snap: moves copies by up to half a voxel, to whole voxels from the first of their part, to compute them once.
        contour_tolerance_mm, channel_tolerance, prove_channels: as the command line has them.
        on_progress: called with the number of layers done and of all.

        Raises ValueError for arguments that don't fit, when the first layer is asked for. Gives the plan's warnings as
        PlanWarnings.
        """
        layers = _checked_layers(layers)
        described = self.job(mesh, pitch, **job)
        plan = self._call(lambda: self._stub.PlanSlices(plan_pb2.PlanSlicesRequest(job=described)),
                          chosen_by=_first_mesh(described))
        for warning in plan.warnings:
            warnings.warn(warning.message, PlanWarning, stacklevel=2)
        first = plan.region.first_layer if plan.HasField("region") else 0
        if layers is None:
            layers = range(first, first + plan.layer_count)
        yield from self._slice_from(described, plan, layers, on_progress)

    def probe(self, mesh: Union[Mesh, str], points_mm: Any, *, placement: Any = None,
              contour_tolerance_mm: Optional[float] = None, fields: Optional[Fields] = None) -> Probe:
        """What is at points (n, 3), in the placed part's frame: values of the mesh's channels, and of fields."""
        points = _points("points_mm", points_mm)
        mesh_id = self._mesh_id(mesh)
        kinds = self._fields(fields, mesh_id)
        names = [*self._channel_names(mesh_id), *kinds]

        def request(part: np.ndarray) -> points_pb2.ProbePointsRequest:
            message = points_pb2.ProbePointsRequest(mesh_id=mesh_id, points_mm=part.ravel().tolist())
            add_fields(message, kinds)
            _place(message, placement)
            if contour_tolerance_mm is not None:
                message.contour_tolerance_mm = contour_tolerance_mm
            return message

        answers = self._in_batches(self._stub.ProbePoints, mesh_id, points, request, len(names))
        locations = _joined(answers, "locations", np.int32)
        outside = locations == points_pb2.POINT_LOCATION_OUTSIDE
        uvw = _joined(answers, "uvw", np.float64).reshape(-1, 3)
        values = _joined(answers, "channel_values", np.float64).reshape(len(points), len(names))
        residuals = _joined(answers, "residuals_mm", np.float64)
        uvw[outside], values[outside], residuals[outside] = np.nan, np.nan, np.nan
        return Probe(locations == points_pb2.POINT_LOCATION_INSIDE, locations == points_pb2.POINT_LOCATION_NEAR,
                     _joined(answers, "control_cells", np.uint32), _joined(answers, "limit_cells", np.uint32), uvw,
                     {name: values[:, i] for i, name in enumerate(names)}, residuals)

    def evaluate(self, mesh: Union[Mesh, str], limit_cells: Any, uvw: Any, *, placement: Any = None) -> Evaluation:
        """The limit at parameters (n, 3) in [0, 1] of limit cells (n,)."""
        parameters = _points("uvw", uvw)
        cells = whole_numbers("limit_cells", limit_cells, f"({len(parameters)},)")
        if cells.shape != (len(parameters),):
            raise ValueError(f"limit_cells must have shape ({len(parameters)},), not {cells.shape}")
        if cells.size and (cells.min() < 0 or cells.max() >= 1 << 32):
            raise ValueError(f"limit_cells are numbers from 0 to {(1 << 32) - 1}, not {cells.min()} to {cells.max()}")
        mesh_id = self._mesh_id(mesh)
        names = self._channel_names(mesh_id)
        both = np.column_stack([cells.astype(np.float64), parameters])

        def request(part: np.ndarray) -> points_pb2.EvaluatePointsRequest:
            message = points_pb2.EvaluatePointsRequest(mesh_id=mesh_id, uvw=part[:, 1:].ravel().tolist(),
                                                       limit_cells=part[:, 0].astype(np.uint32).tolist())
            _place(message, placement)
            return message

        answers = self._in_batches(self._stub.EvaluatePoints, mesh_id, both, request, len(names))
        values = _joined(answers, "channel_values", np.float64).reshape(len(both), len(names))
        return Evaluation(_joined(answers, "positions_mm", np.float64).reshape(-1, 3),
                          {name: values[:, i] for i, name in enumerate(names)},
                          _joined(answers, "jacobians_mm", np.float64).reshape(-1, 3, 3))

    def tessellate(self, mesh: Union[Mesh, str], *, chord_tolerance_mm: Optional[float] = None,
                   placement: Any = None) -> Surface:
        """The boundary as triangles, within a tolerance of the limit."""
        request = surface_pb2.TessellateBoundaryRequest(mesh_id=self._mesh_id(mesh))
        _place(request, placement)
        if chord_tolerance_mm is not None:
            request.chord_tolerance_mm = chord_tolerance_mm
        return self._call(lambda: _read(self._stub.TessellateBoundary(request), _surface))

    def preview(self, mesh: Union[Mesh, str], planes: Iterable[Plane], mm_per_pixel: float, *,
                size: Tuple[int, int] = (512, 512), channel: Optional[str] = None, colours: str = "viridis",
                value_range: Optional[Tuple[float, float]] = None, printing: Optional[Printing] = None,
                placement: Any = None, coarse: bool = False, contours: bool = False, lines: Optional[float] = None,
                every: bool = False, fields: Optional[Fields] = None,
                cut: str = "") -> Iterator[Preview]:
        """Pictures of cuts, as they come.

        planes: where to cut. They are taken as fast as they come, also while a picture is made; of those that come
            meanwhile the latest is shown next. every=True shows each of them.
        size: width and height in pixels of mm_per_pixel.
        channel: shown through colours, "viridis", "cividis" or "grey", over value_range; default: that of the picture.
        printing: shown as the colour that its materials mix to. Neither: one colour where there is material.
        fields, cut: as in slice().
        coarse: whether each picture comes at an eighth of the resolution first. contours: whether with outlines.
        lines: width in pixels of outlines drawn on top, 0.25 to 16; default: none.

        A call that breaks isn't repeated, as the planes are gone: CallError.
        """
        mesh_id = self._mesh_id(mesh)
        kinds = self._fields(fields, mesh_id)
        content = content_message(channel, colours, value_range, printing is not None, lines)
        width, height = pair("size", size, "two numbers, width and height")
        shown = threading.Semaphore(1)

        wrong: List[Exception] = []

        def request(number: int, plane: Plane) -> preview_pb2.PreviewRequest:
            message = preview_pb2.PreviewRequest(number=number, plane=plane_message(plane, mm_per_pixel), width=width,
                                                 height=height, content=content, coarse=coarse, contours=contours,
                                                 cut=cut,
                                                 encoding=preview_pb2.PREVIEW_ENCODING_RGBA)
            add_fields(message, kinds)
            if number == 1:
                message.mesh_id = mesh_id
                _place(message, placement)
                if printing is not None:
                    message.printing.CopyFrom(printing.message)
            return message

        def requests() -> Iterator[preview_pb2.PreviewRequest]:
            """On a thread of grpcio's, which would say nothing of an exception."""
            nonlocal asked
            try:
                for number, plane in enumerate(planes, 1):
                    if every:
                        shown.acquire()
                    asked = number
                    yield request(number, plane)
            except Exception as error:  # pylint: disable=broad-except
                wrong.append(error)

        assembler, asked, pictures = PreviewAssembler(), 0, 0
        call = self._stub.Preview(requests(), mesh_id)
        try:
            for message in call:
                picture = assembler.add(message)
                if picture is None:
                    continue
                pictures += 1
                require_answer(picture.number <= asked and pictures <= 2 * asked, "a picture that nobody asked for")
                if not picture.coarse:
                    shown.release()
                yield picture
        except grpc.RpcError as failed:
            raise self._call_error(failed) from failed
        finally:
            call.cancel()  # If nobody wants the rest.
            shown.release()
        if wrong:
            raise wrong[0]

    def _mesh_id(self, mesh: Union[Mesh, str]) -> str:
        """Uploads a mesh that this client hasn't yet."""
        if isinstance(mesh, str):
            if not is_mesh_id(mesh):
                raise ValueError(f"{mesh!r} isn't the id of a mesh, \"sha256:\" and 64 hexadecimal digits; "
                                 "Mesh.from_file reads .ccmesh files")
            return mesh
        if not isinstance(mesh, Mesh):
            raise ValueError(f"mesh is a ccslice.Mesh or the id of an uploaded one, not {type(mesh).__name__}")
        if mesh.id not in self._meshes:
            self.upload(mesh)
        return mesh.id

    def _fields(self, fields: Optional[Fields], chosen_by: str) -> TakenFields:
        """Uploads volumes that this client hasn't yet, to the server of the mesh `chosen_by`."""
        kinds = taken(fields)
        for field in kinds.values():
            if isinstance(field, Volume) and field.id not in self._meshes:
                self._meshes[field.id] = field
                self._call(lambda volume=field: self._upload_once(volume, chosen_by=chosen_by))  # type: ignore[misc]
        return kinds

    def _channel_names(self, mesh_id: str) -> List[str]:
        mesh = self._meshes.get(mesh_id)
        if isinstance(mesh, Mesh):
            return mesh.channel_names
        summary = self._call(lambda: self._stub.GetMesh(mesh_pb2.GetMeshRequest(mesh_id=mesh_id))).mesh
        return [channel.name for channel in summary.channels]

    def _upload_once(self, mesh: Union[Mesh, Volume],
                     on_preparation: Optional[OnPreparation] = None,
                     chosen_by: str = "") -> mesh_pb2.MeshSummary:
        """chosen_by: the mesh whose server gets it, if not its own: proxies choose by that."""
        def messages() -> Iterator[mesh_pb2.UploadMeshRequest]:
            start = mesh_pb2.UploadStart(mesh_id=mesh.id, size_bytes=len(mesh.content))
            yield mesh_pb2.UploadMeshRequest(start=start)
            for at in range(0, len(mesh.content), _CHUNK_BYTES):
                yield mesh_pb2.UploadMeshRequest(chunk=mesh.content[at:at + _CHUNK_BYTES])

        try:
            upload = self._stub.begin_upload(messages(), chosen_by or mesh.id)
            try:
                if on_preparation is not None:
                    self._watch(upload, mesh.id, on_preparation)
                return upload.result().mesh
            finally:
                upload.cancel()  # If it isn't over, as when on_preparation raised something.
        except grpc.RpcError as failed:
            if failed.code() != grpc.StatusCode.CANCELLED:
                raise
            # Where the server holds the mesh it answers before it has read all, and some proxies make a reset of that.
            return self._stub.GetMesh(mesh_pb2.GetMeshRequest(mesh_id=mesh.id), chosen_by or mesh.id).mesh

    def _watch(self, upload: grpc.Future, mesh_id: str, on_preparation: OnPreparation) -> None:
        """Tells how far the mesh is until its upload is over, or there is no use in asking."""
        last = (mesh_pb2.PREPARATION_PHASE_UNSPECIFIED, 0)
        question: Optional[grpc.Future] = None
        # An answer that is late holds nothing up.
        upload.add_done_callback(lambda _: question is not None and question.cancel())
        while True:
            try:
                upload.exception(timeout=_ASK_EVERY_S)
                return
            except grpc.FutureTimeoutError:
                pass
            question = self._stub.begin_question(mesh_pb2.GetPreparationRequest(mesh_id=mesh_id), _LONGEST_ANSWER_S)
            if upload.done():  # Perhaps before there was a question to be cancelled.
                question.cancel()
            try:
                answer = question.result()
            except grpc.FutureCancelledError:
                return
            except grpc.RpcError as failed:
                if failed.code() == grpc.StatusCode.UNIMPLEMENTED:
                    return
                continue
            now = (answer.phase, answer.done_cells)
            # Another server than the one that prepares may hold the mesh already, or be less far.
            if last < now < (mesh_pb2.PREPARATION_PHASE_PREPARED, 0):
                last = now
                on_preparation(answer)

    def _call_error(self, failed: grpc.RpcError) -> CallError:
        """What is said of a failure, and of a proxy that nobody may have thought of."""
        error = call_error(failed)
        if error.code == grpc.StatusCode.UNAVAILABLE and not error.reason:
            error.args = (str(error) + proxy_hint(self.address), )
        return error

    def _call(self, body: Callable[[], Result], attempts: Optional[_Attempts] = None, chosen_by: str = "") -> Result:
        """Repeats what passes, and uploads what the server has lost. chosen_by: the mesh of the call."""
        attempts = attempts or _Attempts(self._channel, self._patience_s)
        missing: Optional[Union[Mesh, Volume]] = None
        while True:
            try:
                if missing is not None:
                    self._upload_once(missing, chosen_by=chosen_by)
                    missing = None
                return body()
            except grpc.RpcError as failed:
                error = self._call_error(failed)
                missing = self._meshes.get(error.missing_mesh_id)
                if missing is not None:
                    attempts.count_reupload(error)
                    continue
                attempts.wait_after(error)

    def _job(self, mesh: Meshes, pitch: Optional[Pitch], *, channels: Channels = (),
             value_ranges: Optional[Mapping[str, Tuple[float, float]]] = None, occupancy: Optional[bool] = None,
             printing: Optional[Printing] = None, cell_regions: bool = False, contours: bool = False,
             contours_by_cell_region: bool = False, printer: Optional[str] = None, placement: Any = None,
             origin_mm: Any = None, extent: Any = None, box_mm: Any = None,
             contour_tolerance_mm: Optional[float] = None, channel_tolerance: Optional[float] = None,
             prove_channels: bool = False, outside: Optional[float] = None,
             overlaps: str = "priority", snap: bool = False, fields: Optional[Fields] = None,
             cut: str = "") -> job_pb2.SliceJob:
        job = job_pb2.SliceJob(cut=cut, snap=snap)
        if pitch is not None:
            size = job.grid.pitch
            size.x_mm, size.y_mm, size.z_mm = _triple("pitch", pitch)
        elif printer is None:
            raise ValueError("give a pitch in mm, or a printer's name")
        if printer is not None:
            job.printer.name = printer
            job.grid.SetInParent()
        if origin_mm is not None:
            origin = job.grid.origin_mm
            origin.x, origin.y, origin.z = _triple("origin_mm", origin_mm)
        if extent is not None:
            size = job.grid.extent
            size.columns, size.rows, size.layers = _counts("extent", extent)
        if box_mm is not None:
            low, high = pair("box_mm", box_mm, "two corners, ((x, y, z), (x, y, z))")
            for corner, values in ((job.region.box_mm.min_mm, low), (job.region.box_mm.max_mm, high)):
                corner.x, corner.y, corner.z = _triple("box_mm", values)
        if contours or contours_by_cell_region:
            job.contours.by_cell_region = contours_by_cell_region
        self._add_planes(job, channels, value_ranges or {}, occupancy, printing, cell_regions)
        if outside is not None:
            if not any(plane.WhichOneof("content") == "channel" for plane in job.planes):
                raise ValueError("outside is what channels hold outside the part, and channels is empty")
            for plane in job.planes:
                if plane.WhichOneof("content") == "channel":
                    plane.outside_sample = outside
        if contour_tolerance_mm is not None:
            job.tolerances.contour_mm = contour_tolerance_mm
        if channel_tolerance is not None:
            job.tolerances.channel = channel_tolerance
        job.tolerances.prove_channels = prove_channels
        if overlaps not in _OVERLAPS:
            raise ValueError(f"overlaps is one of {', '.join(_OVERLAPS)}, not {overlaps!r}")
        job.overlaps = _OVERLAPS[overlaps]
        self._add_parts(job, mesh, placement)
        add_fields(job, self._fields(fields, _first_mesh(job)))
        return job

    def _add_parts(self, job: job_pb2.SliceJob, mesh: Meshes, placement: Any) -> None:
        if isinstance(mesh, (Mesh, str)) or not isinstance(mesh, Sequence):
            part = job.parts.add(mesh_id=self._mesh_id(mesh))
            if placement is not None:
                part.placements.add().matrix.extend(_matrix(placement))
            return
        if placement is not None:
            raise ValueError("placement is for one mesh; give each Part its placements")
        for number, given in enumerate(mesh, 1):
            if not isinstance(given, Part):
                raise ValueError(f"mesh is a Mesh, its id, or a list of Parts, and item {number - 1} of the list is "
                                 f"{type(given).__name__}")
            part = job.parts.add(mesh_id=self._mesh_id(given.mesh), name=given.name or f"part {number}",
                                 priority=given.priority)
            for matrix in given.placements if given.placements is not None else ():
                part.placements.add().matrix.extend(_matrix(matrix))
            if (given.map is not None or given.region_maps) and not job.HasField("printing"):
                raise ValueError("maps of Parts need the materials of a Printing: give printing")
            for region, own in (given.region_maps or {}).items():
                part.cell_region_maps.add(cell_region=region,
                                          map=material_map(own, strict=job.printing.map.strict))
            if given.map is not None:
                part.map.CopyFrom(material_map(given.map, strict=job.printing.map.strict))
            if given.seed is not None:
                part.halftone_seed = given.seed

    def _add_planes(self, job: job_pb2.SliceJob, channels: Channels, value_ranges: Mapping[str, Tuple[float, float]],
                    occupancy: Optional[bool], printing: Optional[Printing], cell_regions: bool) -> None:
        if isinstance(channels, str):
            raise ValueError(f"channels takes a list of names, as in [{channels!r}]")
        types = dict(channels) if isinstance(channels, Mapping) else {name: "float32" for name in channels}
        strangers = [name for name in value_ranges if name not in types]
        if strangers:
            raise ValueError(f"value_ranges names {strangers[0]!r}, which channels doesn't")
        # A server of this machine has no slow line before it.
        near = self._server is not None or self.address.startswith("unix:")
        encoding = job_pb2.PLANE_ENCODING_RAW
        if not near and _has_zstandard():
            encoding = job_pb2.PLANE_ENCODING_RAW_ZSTD
        if occupancy if occupancy is not None else not (types or printing or cell_regions or job.HasField("contours")):
            plane = job.planes.add(encoding=encoding, sample_type=job_pb2.SAMPLE_TYPE_BIT)
            plane.occupancy.SetInParent()
        for name, dtype in types.items():
            kind = np.dtype(dtype).name
            if kind not in _SAMPLE_TYPES:
                raise ValueError(f"channels[{name!r}] must be one of {', '.join(_SAMPLE_TYPES)}, not {kind}")
            plane = job.planes.add(encoding=encoding, sample_type=_SAMPLE_TYPES[kind])
            plane.channel.name = name
            if name in value_ranges:
                plane.value_range.min, plane.value_range.max = number_pair(
                    f"value_ranges[{name!r}]", value_ranges[name], "two numbers, (low, high)")
        if cell_regions:
            job.planes.add(encoding=encoding, sample_type=job_pb2.SAMPLE_TYPE_UINT8).cell_regions.SetInParent()
        if printing is not None:
            job.planes.add(encoding=encoding, sample_type=job_pb2.SAMPLE_TYPE_UINT8).materials.SetInParent()
            job.printing.CopyFrom(printing.message)

    def _slice_from(self, job: job_pb2.SliceJob, plan: plan_pb2.PlanSlicesResponse, layers: range,
                    on_progress: Optional[Callable[[int, int], None]]) -> Iterator[Layer]:
        """Delivers every layer once, however often streams break. Layers of different engines or grids never mix."""
        request = slice_pb2.SliceRangeRequest(job=job)
        attempts = _Attempts(self._channel, self._patience_s)
        stream = None
        done = 0
        try:
            while done < len(layers):
                request.first_layer, request.layer_count = layers[done], len(layers) - done

                def open_stream():
                    calls = self._stub.SliceRange(request)
                    return calls, next(calls, None)

                stream, first = self._call(open_stream, attempts, chosen_by=_first_mesh(job))
                try:
                    for layer in _layers_of(stream, first, request, plan):
                        attempts.progress()
                        done += 1
                        if on_progress is not None:
                            on_progress(done, len(layers))
                        yield layer
                except grpc.RpcError as failed:
                    error = self._call_error(failed)
                    if error.missing_mesh_id in self._meshes:
                        attempts.count_reupload(error)  # The next stream says so at once, if it is true.
                    else:
                        attempts.wait_after(error)
        finally:
            if stream is not None:
                stream.cancel()

    def _in_batches(self, method: Callable[..., Any], mesh_id: str, rows: np.ndarray,
                    request: Callable[[np.ndarray], Any], channels: int) -> List[Any]:
        """An answer for each batch of rows that fits into one message."""
        most = self.server_info().max_points_per_message
        require_answer(most > 0, "it takes no points")
        batches = [rows[at:at + most] for at in range(0, len(rows), most)] or [rows]

        def answers(stream: Iterable[Any]) -> List[Any]:
            given: List[Any] = []
            for answer in stream:
                fits = len(given) < len(batches) and _has_points(answer, len(batches[len(given)]), channels)
                require_answer(fits, "it doesn't fit the points asked for")
                given.append(answer)
            require_answer(len(given) == len(batches), "the server left points unanswered")
            return given

        return self._call(lambda: _read(method((request(batch) for batch in batches), mesh_id), answers),
                          chosen_by=mesh_id)


def _matrix(placement: Any) -> List[float]:
    matrix = floats("placement", placement, "numbers of shape (3, 4) or (4, 4)")
    if matrix.shape not in ((3, 4), (4, 4)):
        raise ValueError(f"placement must have shape (3, 4) or (4, 4), not {matrix.shape}")
    if matrix.shape == (4, 4) and not np.array_equal(matrix[3], (0, 0, 0, 1)):
        raise ValueError(f"placement must have the last row 0, 0, 0, 1, not {matrix[3].tolist()}")
    return matrix[:3].ravel().tolist()


def _place(request: Any, placement: Any) -> None:
    if placement is not None:
        request.placement.matrix.extend(_matrix(placement))


def _joined(answers: Sequence[Any], field: str, dtype: Any) -> np.ndarray:
    return np.concatenate([np.array(getattr(answer, field), dtype=dtype) for answer in answers])


def _read(call: Any, body: Callable[[Iterable[Any]], Result]) -> Result:
    """What body makes of a call's answers. It ends the call where it doesn't want them all."""
    try:
        return body(call)
    finally:
        call.cancel()


def _has_points(answer: Any, points: int, channels: int) -> bool:
    """Of ProbePoints or EvaluatePoints: whether it is about so many."""
    if isinstance(answer, points_pb2.ProbePointsResponse):
        numbers = {"locations": 1, "limit_cells": 1, "control_cells": 1, "residuals_mm": 1, "uvw": 3}
    else:
        numbers = {"positions_mm": 3, "jacobians_mm": 9}
    numbers["channel_values"] = channels
    return all(len(getattr(answer, name)) == count * points for name, count in numbers.items())


def _kind(plane: job_pb2.PlaneSpec) -> Tuple[Any, ...]:
    return plane.WhichOneof("content"), plane.channel.name, plane.sample_type, plane.encoding


def _layers_of(stream: Any, first: Optional[slice_pb2.SliceRangeResponse], request: slice_pb2.SliceRangeRequest,
               plan: plan_pb2.PlanSlicesResponse) -> Iterator[Layer]:
    if first is None:
        raise AnswerError("the server's answer is wrong: a stream without a header")
    header = first.header
    fits = (list(header.mesh_ids), header.first_layer, header.layer_count) == (
        [part.mesh_id for part in request.job.parts], request.first_layer, request.layer_count)
    if not fits or list(map(_kind, header.planes)) != list(map(_kind, request.job.planes)):
        raise AnswerError("the server's answer is wrong: its header belongs to another request")
    if (header.engine_version, header.grid) != (plan.engine_version, plan.grid):
        raise AnswerError("the server's engine or grid isn't that of the plan and the layers so far; slice the whole "
                          "job again")
    assembler = Assembler(header)
    for message in stream:
        layer = assembler.add(message)
        if layer is not None:
            yield layer
    if not assembler.complete:
        raise AnswerError("the server's answer is wrong: it ended before its summary")


def _surface(stream: Iterable[surface_pb2.TessellateBoundaryResponse]) -> Surface:
    header, points, values, triangles = None, [], [], []
    vertex_count = triangle_count = 0
    for message in stream:
        event = message.WhichOneof("event")
        require_answer((event == "header") == (header is None), f"a message of {event}")
        if event == "header":
            header = message.header
            size = header.vertex_count * (24 + 4 * len(header.channels)) + 12 * header.triangle_count
            require_answer(size <= _MOST_SURFACE_BYTES, "a surface of impossible size")
        elif event == "vertex_chunk":
            chunk = message.vertex_chunk
            count, rest = divmod(len(chunk.positions_mm), 3)
            require_answer(chunk.first_vertex == vertex_count and count > 0, "vertices out of order, or none")
            require_answer(rest == 0 and len(chunk.channel_values) == count * len(header.channels),
                           "vertices without all their numbers")
            vertex_count += count
            require_answer(vertex_count <= header.vertex_count, "more vertices than announced")
            points.append(np.array(chunk.positions_mm, dtype=np.float64))
            values.append(np.array(chunk.channel_values, dtype=np.float32))
        else:
            chunk = message.triangle_chunk
            count, rest = divmod(len(chunk.vertices), 3)
            require_answer(chunk.first_triangle == triangle_count and count > 0, "triangles out of order, or none")
            triangle_count += count
            require_answer(rest == 0 and triangle_count <= header.triangle_count, "more triangles than announced")
            corners = np.array(chunk.vertices, dtype=np.uint32)
            require_answer(int(corners.max()) < vertex_count, "a triangle of an unknown vertex")
            triangles.append(corners)
    require_answer(header is not None, "a surface without a header")
    require_answer(vertex_count == header.vertex_count and triangle_count == header.triangle_count,
                   "a surface with fewer triangles than announced")
    positions = np.concatenate(points or [np.empty(0)]).reshape(-1, 3)
    corners = np.concatenate(triangles or [np.empty(0, np.uint32)]).reshape(-1, 3)
    of_points = np.concatenate(values or [np.empty(0, np.float32)]).reshape(len(positions), len(header.channels))
    return Surface(positions, corners, {channel.name: of_points[:, i] for i, channel in enumerate(header.channels)})


def _name_arguments(method: Callable[..., Any]) -> None:
    """Puts the arguments of a job in place of **job, for help() and completion."""
    signature = inspect.signature(method)
    parameters = [known for known in signature.parameters.values() if known.kind != known.VAR_KEYWORD]
    parameters += [known for known in inspect.signature(Client._job).parameters.values()
                   if known.kind == known.KEYWORD_ONLY]
    setattr(method, "__signature__", signature.replace(parameters=parameters))


for _method in (Client.plan, Client.job, Client.slice):
    _name_arguments(_method)

"""The differentiable shadow renderer: bodies + poses + cameras -> silhouettes `(K, H, W)` in [0, 1].

No face is rasterised. Seen from a camera, the front-facing triangles of a closed surface are bounded by its contour
edges, and the number of front layers over a pixel is the winding number of those edges about it. So:

1. each contour edge is cut with the pixel rows; the signed cuts, summed along each row, give the winding number
   of every pixel's centre at once, for all bodies together; the silhouette is where it is positive;
2. where a pixel inside has a neighbour outside, the outermost contour edge between their centres says how far the
   silhouette reaches, and the pair is shaded accordingly (analytic antialiasing, after Laine et al. 2020, nvdiffrast);
3. the gradient flows back through those crossings alone, as forces on the points of the edges.

The cost is that of the contours' length in pixels plus one cumulative sum. Softness is a Gaussian blur of that exact
image, so a soft contour stays centred on the true one, and what is hidden behind another body pulls on nothing.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import pad

from .geometry.meshes import Body
from .geometry.silhouette_edges import Outlines, Views, contour_edges, eye_distance, project
from .kernels import dispatch, wrenches
from .util import capacity
from .util.devices import side_by_side

SHADE = 2.0**-40  # the step in which shades of a pixel are summed


def render_at_rest(body: Body, views: Views, resolution: int) -> Tensor:
    """Coverage `(K, resolution, resolution)` of one body where its file has it."""
    outlines = Outlines([body], views.axes.device, views.axes.dtype)
    identity = torch.eye(3, device=views.axes.device, dtype=views.axes.dtype)[None]
    return render(outlines, identity, torch.from_numpy(body.centre[None]).to(identity), views, resolution)


def render(outlines: Outlines, rotation: Tensor, translation: Tensor, views: Views, resolution: int) -> Tensor:
    """Silhouettes of all bodies together, `(K, resolution, resolution)`, antialiased over one pixel.

    rotation `(N, 3, 3)`, translation `(N, 3)`, of the outlines' dtype and device; differentiable in both. Those of S
    starts, `(S, N, 3, 3)` and `(S, N, 3)`, give `(S, K, resolution, resolution)`. A pixel
    is at least 0.5 exactly where its centre is covered, but for what is thinner than a pixel: that is shaded by its
    width. Perspective views need every body in front of the eye.
    """
    if dispatch.compiled(rotation.device):
        return _Compiled.apply(rotation, translation, outlines, views, resolution)
    if rotation.dim() == 4:
        starts = zip(rotation, translation, strict=True)
        return torch.stack([render(outlines, turns, places, views, resolution) for turns, places in starts])
    return _Render.apply(rotation, translation, outlines, views, resolution)


def mask(outlines: Outlines, rotation: Tensor, translation: Tensor, views: Views, resolution: int) -> Tensor:
    """Hard silhouettes `(K, resolution, resolution)` bool: True where a pixel's centre is covered. For judging."""
    if dispatch.compiled(rotation.device):
        return torch.from_numpy(_drawn(rotation, translation, outlines, views, resolution)[1])
    with torch.no_grad():
        return _Contours(outlines, rotation, translation, views, resolution).inside()


def likeness(images: np.ndarray, others: np.ndarray) -> np.ndarray:
    """`(K,)` intersection over union of silhouettes `(K, H, W)` bool."""
    return (images & others).sum((1, 2)) / (images | others).sum((1, 2))


def soften(images: Tensor, softness_px: float | Tensor) -> Tensor:
    """Images `(..., H, W)` blurred by a Gaussian of `softness_px` pixels (0: as they are), 0 beyond the border.

    A softness in a tensor `()` must not be 0; it may change between plays of what was recorded with it.
    """
    if not isinstance(softness_px, Tensor) and softness_px <= 0:
        return images
    if dispatch.compiled(images.device) and not images.requires_grad:
        from .kernels import blur

        kernel = _gaussian(min(int(np.ceil(3 * softness_px)), images.shape[-1] - 1), softness_px, images).numpy()
        sharp = images.reshape(-1, *images.shape[-2:]).contiguous()
        across, soft = torch.zeros_like(sharp), torch.zeros_like(sharp)
        dispatch.in_parallel(blur.along_rows, sharp.numpy(), kernel, across.numpy())
        dispatch.in_parallel(blur.along_columns, across.numpy(), kernel, soft.numpy())
        return soft.view(images.shape)
    # along a line it is a product with a matrix whose rows are the Gaussian, cut off at the border
    width = images.shape[-1]
    kernel = _gaussian(width - 1, softness_px, images)
    down, across = (pad(kernel, (n - width, n - width)).unfold(0, n, 1).flip(0) for n in images.shape[-2:])
    return down @ images @ across


def _gaussian(reach: int, softness_px: float | Tensor, like: Tensor) -> Tensor:
    """`(2 * reach + 1,)`, 0 beyond three times the softness, of sum 1."""
    steps = torch.arange(-reach, reach + 1, dtype=like.dtype, device=like.device)
    kernel = torch.exp(-0.5 * (steps / softness_px) ** 2)
    kernel = torch.where(steps.abs() < 3 * softness_px + 1, kernel, 0)
    return kernel / kernel.sum()


def _cuts(first: Tensor, last: Tensor, resolution: int, cut: Tensor | None, name: str):
    """For each edge that is to be `cut` the pixel lines whose centres lie in [first, last): the edges' indices, the
    lines, and which of them are real, see `util.capacity`."""
    low = (torch.minimum(first, last) - 0.5).ceil().clamp(0, resolution).long()
    high = (torch.maximum(first, last) - 0.5).ceil().clamp(0, resolution).long()
    return capacity.ranges(low, capacity.only(cut, high - low), name)


def _cross(across: Tensor, along: Tensor, edge: Tensor, line: Tensor, real: Tensor | None):
    """Where edges cut pixel lines: parameter on the edge in [0, 1], coordinate across, slope d across / d along."""
    start, span = along[edge, 0], (along[:, 1] - along[:, 0])[edge]
    parameter = capacity.only(real, (line + 0.5 - start) / span)
    rise = (across[:, 1] - across[:, 0])[edge]
    return parameter, across[edge, 0] + parameter * rise, capacity.only(real, rise / span)


class _Contours:
    """The contour edges over all views, and their cuts with the pixel rows."""

    def __init__(self, outlines, rotation, translation, views, resolution):
        self.views, self.n = len(views.width), resolution
        pixels, self.depth = project(outlines, rotation, translation, views, resolution)
        self.view, self.edge, self.sign, self.real = contour_edges(outlines, rotation, translation, views)
        ends = pixels.view(-1, 2)[(self.view * pixels.shape[1])[:, None] + outlines.edges[self.edge, :2]]
        self.u, self.v = ends[..., 0], ends[..., 1]
        self.cut, self.row, real = _cuts(self.v[:, 0], self.v[:, 1], resolution, self.real, "cuts with rows")
        self.parameter, self.x, self.slope = _cross(self.u, self.v, self.cut, self.row, real)
        # +1 enters the silhouette to the right
        self.turn = capacity.only(real, torch.where(self.v[:, 1] > self.v[:, 0], self.sign, -self.sign)[self.cut])

    def inside(self) -> Tensor:
        """`(K, H, W)` bool, where the winding number about the pixels' centres is positive."""
        n = self.n
        column = (self.x - 0.5).ceil().clamp(0, n).long()
        winding = torch.zeros(self.views * n * (n + 1), dtype=torch.int32, device=self.x.device)
        winding.index_add_(0, (self.view[self.cut] * n + self.row) * (n + 1) + column, self.turn)
        return winding.view(-1, n, n + 1).cumsum(2)[:, :, :n] > 0


class _Render(torch.autograd.Function):
    @staticmethod
    def forward(ctx, rotation, translation, outlines, views, n):
        lines = _Contours(outlines, rotation, translation, views, n)
        view, u, v = lines.view, lines.u, lines.v

        # shade the pixel pairs that a contour runs between: along rows for steep edges, along columns for flat ones
        steep = (v[:, 1] - v[:, 0]).abs() >= (u[:, 1] - u[:, 0]).abs()
        with side_by_side(rotation.device, "axes") as aside:
            with aside():
                flat = capacity.only(lines.real, ~steep)
                cut, column, real = _cuts(u[:, 0], u[:, 1], n, flat, "cuts with columns")
                parameter, y, slope = _cross(v, u, cut, column, real)
                down = torch.where(u[:, 1] > u[:, 0], -lines.sign, lines.sign)[cut]  # +1 enters downwards
            inside = lines.inside()
            turn = torch.where(steep[lines.cut], lines.turn, 0)
        with side_by_side(rotation.device, "axes") as aside:
            with aside():
                along_columns = _pairs(inside, view, cut, column, y, capacity.only(real, down), 0)
            along_rows = _pairs(inside, view, lines.cut, lines.row, lines.x, turn, 1)
        passed = [(lines.cut, lines.parameter, lines.slope), (cut, parameter, slope)]
        pairs = [along_rows, along_columns]

        saved = [
            (cut[kept], pixel, rising, parameter[kept], slope[kept])
            for (kept, pixel, _, rising), (cut, parameter, slope) in zip(pairs, passed, strict=True)
        ]
        pixel, shade = (torch.cat([pair[k] for pair in pairs]) for k in (1, 2))
        image = inside + wrenches.sum_in_steps(inside.numel(), pixel, shade, SHADE).view(inside.shape)
        ctx.scene = (outlines, views, n, view, lines.edge, saved, lines.depth)
        ctx.save_for_backward(rotation, translation, image)
        return image.clamp(0, 1)

    @staticmethod
    def backward(ctx, upstream):
        outlines, views, n, view, edge, saved, depth = ctx.scene
        rotation, translation, image = ctx.saved_tensors
        upstream = torch.where((image < 0) | (image > 1), 0, upstream).reshape(-1)
        right, up = views.axes[:, 0], views.axes[:, 1]
        scale = n / views.width[:, None]

        def pulled(axis, cut, pixel, rising, parameter, slope):
            k, vertex = view[cut], outlines.edges[edge[cut], :2]
            if depth is not None:  # the 2D parameter runs faster where the edge is near
                d0, d1 = depth[k, vertex[:, 0]], depth[k, vertex[:, 1]]
                fraction = parameter / d1 / ((1 - parameter) / d0 + parameter / d1)
            else:
                fraction = parameter
            point = torch.lerp(outlines.vertices[vertex[:, 0]], outlines.vertices[vertex[:, 1]], fraction[:, None])
            body = outlines.vertex_body[vertex[:, 0]]
            du, dv = (right * scale)[k], (-up * scale)[k]
            if depth is not None:
                du, dv = _perspective_jacobian(views, n, k, point, rotation[body], translation[body], du, dv)
            moved = du - slope[:, None] * dv if axis == 0 else dv - slope[:, None] * du
            force = (upstream[pixel] * rising)[:, None] * moved
            return wrenches.gather(outlines.count, body, point, force)

        with side_by_side(rotation.device, "axes") as aside:
            with aside():
                along_columns = pulled(1, *saved[1])
            along_rows = pulled(0, *saved[0])
        return *wrenches.gradients(along_rows + along_columns), None, None, None


def _drawn(rotation, translation, outlines, views, n):
    """What the compiled renderer draws: image before clamping, mask, and what the way back needs."""
    from .kernels import silhouettes

    place = wrenches.arrays(rotation, translation)
    count, dtype = len(place[0]) * len(views.width), place[0].dtype
    drawn = (
        np.empty((count, n, n), dtype),
        np.empty((count, n, n), np.bool_),
        np.full((count, 2, n, n), -1, dtype),
        np.full((count, 2, n, n), -1, np.int32),
        np.empty((count, len(outlines.vertices), 2), dtype),
        np.empty((count, len(outlines.vertices)), dtype),
    )
    dispatch.in_parallel(silhouettes.render, outlines.arrays, *place, views.arrays, drawn)
    return drawn


class _Compiled(torch.autograd.Function):
    """`_Render` by compiled loops, for tensors on the CPU."""

    @staticmethod
    def forward(ctx, rotation, translation, outlines, views, n):
        drawn = _drawn(rotation, translation, outlines, views, n)
        ctx.scene = (outlines, views, drawn)
        ctx.save_for_backward(rotation, translation)
        return torch.from_numpy(drawn[0]).clamp(0, 1).view(*rotation.shape[:-3], -1, n, n)

    @staticmethod
    def backward(ctx, upstream):
        from .kernels import silhouettes

        outlines, views, drawn = ctx.scene
        rotation, translation = ctx.saved_tensors
        image = torch.from_numpy(drawn[0])
        upstream = torch.where((image < 0) | (image > 1), 0, upstream.reshape(image.shape)).contiguous().numpy()
        place = wrenches.arrays(rotation, translation)
        wrench = np.zeros((len(place[0]), len(views.width), rotation.shape[-3], 4, 3))
        flat = wrench.reshape(-1, *wrench.shape[2:])
        dispatch.in_parallel(silhouettes.pull, upstream, outlines.arrays, *place, views.arrays, drawn, flat)
        total = torch.from_numpy(wrench.sum(1)).to(rotation.dtype).view(*rotation.shape[:-2], 4, 3)
        return *wrenches.gradients(total), None, None, None


def _perspective_jacobian(views, n, k, point, rotation, translation, du, dv):
    """Rows d u / d x and d v / d x `(M, 3)` of the pixel coordinates at world points, in perspective views."""
    world = (rotation @ point[:, :, None])[:, :, 0] + translation - views.centre[k]
    forward, distance = views.axes[k, 2], eye_distance(views)[k, None]
    ratio = torch.where(views.perspective[k, None], 1 + (world * forward).sum(1, keepdim=True) / distance, 1.0)
    bend = torch.where(views.perspective[k, None], forward / distance / ratio, 0.0)
    shift_u, shift_v = (du * world).sum(1, keepdim=True) / ratio, (dv * world).sum(1, keepdim=True) / ratio
    return du / ratio - shift_u * bend, dv / ratio - shift_v * bend


def _pairs(inside: Tensor, view: Tensor, cut: Tensor, line: Tensor, place: Tensor, turn: Tensor, axis: int):
    """Neighbouring pixels that a contour runs between, with the shade that the outermost crossing leaves.

    turn : +1 where the silhouette is entered, -1 where it is left, 0 for cuts that do not count. axis 1: neighbours
    along a row (`line` is the row), 0: along a column. Returns which cuts are outermost, the pixel that each one shades
    (flat index), by how much, and the sign of d shade / d place; no shade and no sign for what is not real.
    """
    n = inside.shape[1]
    first = (place - 0.5).floor().long()
    valid = (first >= 0) & (first < n - 1)
    k, safe = view[cut], first.clamp(0, n - 2)
    step, base = (1, (k * n + line) * n + safe) if axis == 1 else (n, (k * n + safe) * n + line)
    flat = inside.reshape(-1)
    before, after = flat[base], flat[base + step]
    kept = valid & torch.where(turn > 0, after & ~before, before & ~after) & (turn != 0)
    kept, real = capacity.found(kept, f"cuts along contours, axis {axis}")
    base, place, entering = base[kept], (place - 0.5 - first)[kept], turn[kept] > 0
    reach = torch.where(entering, 1 - place, place)  # from the inner pixel's centre, in pixels

    order = torch.arange(len(kept), device=kept.device)
    rank = (reach.double() * 2**30).long() * 2**32 + order  # the outermost wins, one winner for each pair
    best = torch.full((flat.numel(),), -1, dtype=torch.int64, device=kept.device)
    best.scatter_reduce_(0, base, rank if real is None else torch.where(real, rank, -1), "amax")
    won, real = capacity.found(capacity.only(real, best[base] == rank), f"pixels along contours, axis {axis}")
    kept, base, reach, entering = kept[won], base[won], reach[won], entering[won]
    on_inner = reach < 0.5
    pixel = torch.where(on_inner == entering, base + step, base)
    rising = torch.where(entering, -1.0, 1.0).to(reach.dtype)
    return kept, pixel, capacity.only(real, reach - 0.5), capacity.only(real, rising)

"""Light transport: paths from the camera, one light asked at every bounce."""

from typing import Any

import numpy as np
from jaxtyping import Float32

from panoscene.synth.render._camera import home_from_camera
from panoscene.synth.render._light_choice import LAMP, PANE, SUN, LightChoice, RoomGrid
from panoscene.synth.render._mitsuba import Engine
from panoscene.synth.render._outside import SKY_CELLS, sky_cells
from panoscene.synth.render._path import Hit, Path
from panoscene.synth.render._records import Camera
from panoscene.synth.render._stage import Stage
from panoscene.synth.render._surface import (
    Surface,
    leave,
    meet,
    meet_plainly,
    reflected,
    sample_reflection,
)

_ROULETTE_FROM = 2
_BANDS = 4
"""The first and the last reach from a pole to 45 degrees: the sphere there has few pixels' worth,
and they get half as many paths."""
_MOST_PASSES = 8
"""A path goes through at most so many sheets of glass or gauze."""


class Tracer:
    """Casts the paths of one lit scene."""

    def __init__(
        self,
        engine: Engine,
        stage: Stage,
        grid: RoomGrid,
        choice: LightChoice,
        outside: Float32[np.ndarray, "rows columns 3"],
    ) -> None:
        mi = engine.mi
        self.engine, self.stage = engine, stage
        self.lights = engine.dr.opaque(mi.UInt32, len(choice.kind))
        self.kind = mi.UInt32(choice.kind.astype(np.uint32))
        flat = [choice.centre, choice.half_u, choice.half_v, choice.normal, choice.radiance]
        self.centre, self.u, self.v, self.n, self.radiance = (
            mi.Float(np.ascontiguousarray(a, dtype=np.float32).reshape(-1)) for a in flat
        )
        tables = [choice.size, choice.chance, choice.accept]
        self.size, self.chance, self.accept = (
            mi.Float(np.ascontiguousarray(a, dtype=np.float32).reshape(-1)) for a in tables
        )
        self.alias = mi.UInt32(choice.alias.astype(np.uint32).reshape(-1))
        self.cells = mi.UInt32(grid.cells.astype(np.uint32).reshape(-1))
        self.rows, self.columns = (engine.dr.opaque(mi.UInt32, n) for n in grid.cells.shape)
        self.origin = [engine.dr.opaque(mi.Float, value) for value in grid.origin]
        self.per_metre = 1.0 / grid.cell
        self.sky = mi.Float(sky_cells(outside).reshape(-1))
        wrap = engine.dr.WrapMode.Repeat
        self.outside = mi.Texture2f(mi.TensorXf(np.ascontiguousarray(outside)), wrap_mode=wrap)

    def trace(
        self, camera: Camera, samples: int, depth: int, seed: int
    ) -> Float32[np.ndarray, "height width 9"]:
        """Return radiance, albedo and normal (camera frame) averaged over each pixel.

        Pixels nearer to a pole than 45 degrees, which see little, get half of the samples.
        """
        shares = [samples if 0 < k < _BANDS - 1 else -(-samples // 2) for k in range(_BANDS)]
        bands = [
            self._trace_band(camera, share, depth, (seed + 7919 * k) % 2**32, k)
            for k, share in enumerate(shares)
        ]
        image = np.concatenate(bands)[: camera.width * camera.height]
        return np.nan_to_num(image.reshape(camera.height, camera.width, 9), posinf=0.0, neginf=0.0)

    def _trace_band(
        self, camera: Camera, samples: int, depth: int, seed: int, band: int
    ) -> Float32[np.ndarray, "pixels 9"]:
        """Return one of the bands of rows that are traced one after the other, to save memory."""
        mi, dr = self.engine.mi, self.engine.dr
        pixels = camera.width * -(-camera.height // _BANDS)
        sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
        count = sampler.sample_count()
        sampler.set_samples_per_wavefront(count)
        sampler.seed(seed, pixels * count)
        index = dr.arange(mi.UInt32, pixels * count) // count + dr.opaque(mi.UInt32, band * pixels)
        jitter = sampler.next_2d()
        x = (mi.Float(index % camera.width) + jitter.x) / camera.width
        y = (mi.Float(index // camera.width) + jitter.y) / camera.height
        ray = self.camera_ray(camera, x, y)
        start, nothing = mi.Vector3f(ray.d), mi.Color3f(0)
        path = Path(
            mi.Ray3f(ray), nothing, mi.Color3f(1), mi.UInt32(0), mi.UInt32(0), mi.Bool(True),
            mi.Bool(True), mi.Float(1), mi.UInt32(0), mi.Bool(False), mi.Color3f(0),
            mi.Vector3f(0), mi.Bool(False), mi.Bool(False),
            mi.PCG32(pixels * count, initstate=dr.opaque(mi.UInt64, seed + 1)),
        )  # fmt: skip
        limit = dr.opaque(mi.UInt32, depth)
        # what is seen sharply needs far more code than what only gathers light
        path, sampler = dr.while_loop(
            (path, sampler),
            lambda path, sampler: path.active & path.clear,
            lambda path, sampler: self._bounce(path, sampler, limit),
            label="sharp",
        )
        path, sampler = dr.while_loop(
            (path, sampler),
            lambda path, sampler: path.active,
            lambda path, sampler: self._gather(path, sampler, limit),
            label="gathering",
        )
        view = self._view_out(path.ray.d)
        path.light[path.outdoors] += path.beta * view
        ahead = self._view_out(start)
        path.albedo[path.framed] = ahead / (1 + ahead)
        turn = self._matrix(camera)
        to_camera = [dr.dot(mi.Vector3f(*row), path.normal) for row in zip(*turn, strict=True)]
        channels = [*path.light, *path.albedo, *to_camera]
        dr.eval(channels)
        sums = [np.array(dr.block_sum(channel, count)) for channel in channels]
        return np.stack(sums, axis=-1) / np.float32(count)

    def camera_ray(self, camera: Camera, x: Any, y: Any) -> Any:
        """Return the rays through points of the image, in [0, 1] from its upper left corner."""
        mi, dr = self.engine.mi, self.engine.dr
        sin_lon, cos_lon = dr.sincos((x - 0.5) * dr.two_pi)
        sin_lat, cos_lat = dr.sincos((0.5 - y) * dr.pi)
        local = mi.Vector3f(cos_lat * sin_lon, cos_lat * cos_lon, sin_lat)
        world = [dr.dot(mi.Vector3f(*row), local) for row in self._matrix(camera)]
        place = mi.Point3f(*(dr.opaque(mi.Float, float(a)) for a in camera.position))
        return mi.Ray3f(place, dr.normalize(mi.Vector3f(*world)))

    def _matrix(self, camera: Camera) -> list[list[Any]]:
        mi, dr = self.engine.mi, self.engine.dr
        return [[dr.opaque(mi.Float, float(a)) for a in row] for row in home_from_camera(camera)]

    # ---- one bounce -------------------------------------------------------------------------

    def _bounce(self, path: Path, sampler: Any, limit: Any) -> tuple[Path, Any]:
        """Return the paths after the next surface, which is seen sharply."""
        hit, pane_met, pane = self.cast(path.ray, path.depth == 0, path.active)
        s = meet(self.engine, self.stage, path.ray, hit, hit.valid)
        veil = hit.valid & (hit.face >= self.stage.first_veil)
        choice, side = path.chance.next_float32(), path.chance.next_float32()
        glass = veil & s.glass
        passed = veil & (s.glass | (choice >= s.opacity))
        framed = pane_met & ~path.guided
        path.framed |= framed
        path.guided |= framed
        turned = self._reflect_in_glass(path, s, glass, (pane_met, pane), hit.t)
        self._pass_through(path, s, passed & ~turned, glass)
        path.passes[passed | turned] += 1
        escaped = pane_met & ~turned
        path.outdoors |= escaped
        surface = hit.valid & ~passed & ~turned
        path.light[surface] += path.beta * s.glow
        self._guide(path, s, surface)
        surface &= path.depth + 1 < limit
        # gauze is lit from either side
        through = surface & veil & (s.opacity < 0.95) & (side < 0.5)
        self._turn_over(s, through)
        self._ask_a_light(path, sampler, s, surface & ~s.mirror)
        moved = (passed | turned) & (path.passes < _MOST_PASSES)
        path.active &= ~escaped & (surface | moved)
        self._scatter(path, sampler, s, surface)
        path.clear &= s.mirror | ~surface
        return path, sampler

    def _gather(self, path: Path, sampler: Any, limit: Any) -> tuple[Path, Any]:
        """Return the paths after the next surface, of which only the light matters."""
        goes_on = path.active & (path.depth + 1 < limit)
        solid, pane_met, pane = self._cast_solid(path.ray, path.active, goes_on)
        self._escape(path, pane_met, pane)
        surface = goes_on & solid.is_valid()
        hit = Hit(solid.t, solid.prim_uv, solid.prim_index, surface)
        s = meet_plainly(self.engine, self.stage, path.ray, hit, surface)
        self._ask_a_light(path, sampler, s, surface & ~s.mirror)
        path.active &= surface
        self._scatter(path, sampler, s, surface)
        return path, sampler

    def cast(self, ray: Any, coherent: Any, active: Any) -> tuple[Hit, Any, Any]:
        """Return the nearest triangles, which rays meet a window pane before, and which pane."""
        mi, dr = self.engine.mi, self.engine.dr
        stage = self.stage
        solid = stage.solids.ray_intersect_preliminary(ray, coherent, active)
        met = active & solid.is_valid()
        nearer = mi.Ray3f(ray)
        nearer.maxt = dr.select(met, solid.t, ray.maxt)
        veil = stage.veils.ray_intersect_preliminary(nearer, coherent, active)
        veiled = active & veil.is_valid()
        nearer.maxt = dr.select(veiled, veil.t, nearer.maxt)
        pane = stage.panes.ray_intersect_preliminary(nearer, coherent, active)
        pane_met = active & pane.is_valid()
        t = dr.select(pane_met, pane.t, nearer.maxt)
        face = dr.select(veiled, veil.prim_index + stage.first_veil, solid.prim_index)
        uv = dr.select(veiled, veil.prim_uv, solid.prim_uv)
        hit = Hit(t, uv, face, (met | veiled) & ~pane_met)
        return hit, pane_met, pane.prim_index // 2

    def _cast_solid(self, ray: Any, active: Any, goes_on: Any) -> tuple[Any, Any, Any]:
        """Return the nearest solid triangles, and the window panes that rays meet before.

        The triangles behind a path's last bounce are of no interest, only whether one hides a pane.
        """
        mi, dr = self.engine.mi, self.engine.dr
        pane = self.stage.panes.ray_intersect_preliminary(ray, False, active)
        ahead = active & pane.is_valid()
        nearer = mi.Ray3f(ray)
        nearer.maxt = dr.select(ahead, pane.t, ray.maxt)
        wanted = goes_on | ahead
        solid = self.stage.solids.ray_intersect_preliminary(nearer, False, wanted)
        return solid, ahead & ~solid.is_valid(), pane.prim_index // 2

    def _turn_over(self, s: Surface, where: Any) -> None:
        """Turn surfaces so that they are lit from behind."""
        mi, dr = self.engine.mi, self.engine.dr
        s.flat = dr.select(where, -s.flat, s.flat)
        s.frame = dr.select(where, mi.Frame3f(-s.frame.n), s.frame)

    def _reflect_in_glass(
        self, path: Path, s: Surface, glass: Any, panes: tuple[Any, Any], at: Any
    ) -> Any:
        """Turn some of the clear paths around at a sheet of glass; return which ones."""
        mi, dr = self.engine.mi, self.engine.dr
        pane_met, pane = panes
        sheet_met = glass | pane_met
        normal = dr.select(pane_met, dr.gather(mi.Vector3f, self.n, pane, pane_met), s.flat)
        along = dr.dot(path.ray.d, normal)
        once = 0.04 + 0.96 * (1 - dr.minimum(dr.abs(along), 1)) ** 5
        sheet = 2 * once / (1 + once)  # both faces of a thin sheet, with all inner reflections
        share = dr.select(pane_met, 2 * sheet / (1 + sheet), sheet)  # windows have two sheets
        turned = sheet_met & (path.chance.next_float32() < share)
        there = path.ray(at) - normal * dr.sign(along) * 1e-4
        bounced = mi.Ray3f(there, path.ray.d - 2 * along * normal)
        path.ray = dr.select(turned, bounced, path.ray)
        return turned

    def _pass_through(self, path: Path, s: Surface, through: Any, glass: Any) -> None:
        """Move the paths that go through glass or gauze behind it."""
        mi, dr = self.engine.mi, self.engine.dr
        thick = dr.minimum(s.opacity, 0.6)
        path.beta[through & glass] *= 1 - thick + thick * s.colour
        behind = mi.Ray3f(s.place + path.ray.d * 3e-4, path.ray.d)
        path.ray = dr.select(through, behind, path.ray)

    def _escape(self, path: Path, escaped: Any, pane: Any) -> None:
        """Add the daylight that paths meet by chance."""
        dr = self.engine.dr
        asked = self._chance(path.room, pane, escaped) * self._pane_pdf(path.ray, pane, escaped)
        weight = path.pdf / dr.maximum(path.pdf + asked, 1e-9)
        path.light[escaped] += path.beta * self._sky(path.ray.d) * weight

    def _guide(self, path: Path, s: Surface, surface: Any) -> None:
        """Keep colour and normal of the first surface that is no mirror, for the denoiser."""
        new = surface & ~path.guided & ~s.mirror
        path.albedo[new] = s.colour
        path.normal[new] = s.smooth
        path.guided |= new

    def _scatter(self, path: Path, sampler: Any, s: Surface, surface: Any) -> None:
        """Send the paths on, and end the faint ones by chance."""
        dr = self.engine.dr
        choice, xi = path.chance.next_float32(), sampler.next_2d(surface)
        way, weight, density = sample_reflection(self.engine, s, choice, xi)
        path.beta[surface] *= weight
        path.pdf[surface] = density
        path.room[surface] = self._room_of(s.place)
        path.ray = dr.select(surface, leave(self.engine, s, way), path.ray)
        path.depth[surface] += 1
        keep = dr.minimum(dr.max(path.beta), 0.95)
        risky = surface & (path.depth >= _ROULETTE_FROM)
        lucky = path.chance.next_float32() < keep
        path.beta[risky] *= dr.rcp(dr.maximum(keep, 1e-3))
        path.active &= (~risky | lucky) & (dr.max(path.beta) > 0)

    # ---- lights -----------------------------------------------------------------------------

    def _ask_a_light(self, path: Path, sampler: Any, s: Surface, surface: Any) -> None:
        """Add the light of one source, chosen by the table of the room that the point is in."""
        mi, dr = self.engine.mi, self.engine.dr
        pick, xi = sampler.next_1d(surface) * mi.Float(self.lights), sampler.next_2d(surface)
        room = self._room_of(s.place)
        slot = dr.minimum(mi.UInt32(pick), self.lights - 1)
        entry = room * self.lights + slot
        kept = pick - mi.Float(slot) < dr.gather(mi.Float, self.accept, entry, surface)
        light = dr.select(kept, slot, dr.gather(mi.UInt32, self.alias, entry, surface))
        chance = self._chance(room, light, surface)
        kind = dr.gather(mi.UInt32, self.kind, light, surface)
        way, far, radiance, pdf = self._pane_sample(s.place, light, xi, surface)
        lamp = surface & (kind == LAMP)
        sample = self._lamp_sample(s.place, light, xi, lamp)
        way, far, radiance, pdf = (
            dr.select(lamp, b, a) for a, b in zip((way, far, radiance, pdf), sample, strict=True)
        )
        sun = surface & (kind == SUN)
        sample = self._sun_sample(s, light, xi, sun)
        way, far, radiance, pdf = (
            dr.select(sun, b, a) for a, b in zip((way, far, radiance, pdf), sample, strict=True)
        )
        value, by_surface = reflected(self.engine, s, way)
        pdf *= chance
        good = surface & (pdf > 1e-9) & (dr.max(value) > 0) & (dr.max(radiance) > 0)
        weight = dr.select(kind == PANE, pdf / (pdf + by_surface), 1.0)
        ray = leave(self.engine, s, way)
        ray.maxt = far
        free = good & ~self.stage.solids.ray_test(ray, good)
        path.light[free] += path.beta * value * radiance * (weight / dr.maximum(pdf, 1e-9))

    def _pane_sample(self, place: Any, light: Any, xi: Any, active: Any) -> tuple:
        """Return direction, distance, radiance and density of a point on a window pane."""
        mi, dr = self.engine.mi, self.engine.dr
        c, u, v, n = (
            dr.gather(mi.Vector3f, a, light, active) for a in (self.centre, self.u, self.v, self.n)
        )
        area = dr.gather(mi.Float, self.size, light, active)
        way = c + u * (2 * xi.x - 1) + v * (2 * xi.y - 1) - mi.Vector3f(place)
        far = dr.norm(way)
        way /= dr.maximum(far, 1e-6)
        cosine = -dr.dot(way, n)
        density = dr.select(cosine > 1e-4, far * far / (dr.maximum(cosine, 1e-4) * area), 0)
        return way, far * 0.999, self._sky(way), density

    def _lamp_sample(self, place: Any, light: Any, xi: Any, active: Any) -> tuple:
        """Return direction, distance, radiance and density of a point on a lamp's ball."""
        mi, dr = self.engine.mi, self.engine.dr
        centre = dr.gather(mi.Point3f, self.centre, light, active)
        radius = dr.gather(mi.Float, self.size, light, active)
        axis = mi.Vector3f(centre - place)
        far = dr.maximum(dr.norm(axis), 1e-3)
        frame = mi.Frame3f(axis / far)
        sine2 = dr.minimum((radius / far) ** 2, 0.999)
        spread = sine2 / (1 + dr.sqrt(1 - sine2))  # 1 - cos of the cone, without cancellation
        up = 1 - xi.x * spread
        across = dr.safe_sqrt(1 - up * up)
        sin_turn, cos_turn = dr.sincos(dr.two_pi * xi.y)
        way = frame.to_world(mi.Vector3f(across * cos_turn, across * sin_turn, up))
        # a surface that almost touches a lamp is not burnt out: real bulbs sit in sockets
        soft = far * far / (far * far + 0.01)
        radiance = dr.gather(mi.Color3f, self.radiance, light, active) * soft
        return way, dr.maximum(far - radius, 1e-3), radiance, 1 / (dr.two_pi * spread)

    def _sun_sample(self, s: Surface, light: Any, xi: Any, active: Any) -> tuple:
        """Return direction, distance to the pane on the way, irradiance and density of the sun."""
        mi, dr = self.engine.mi, self.engine.dr
        frame = mi.Frame3f(dr.gather(mi.Vector3f, self.n, light, active))
        spread = dr.sqrt(xi.x) * dr.gather(mi.Float, self.size, light, active)
        sin_turn, cos_turn = dr.sincos(dr.two_pi * xi.y)
        way = dr.normalize(frame.to_world(mi.Vector3f(spread * cos_turn, spread * sin_turn, 1)))
        hit = self.stage.panes.ray_intersect_preliminary(leave(self.engine, s, way), False, active)
        irradiance = dr.gather(mi.Color3f, self.radiance, light, active)
        open_to_it = active & hit.is_valid()
        return way, hit.t, dr.select(open_to_it, irradiance, mi.Color3f(0)), mi.Float(1)

    def _sky(self, way: Any) -> Any:
        """Return the radiance of the outside in a direction, coarsely: as light."""
        mi, dr = self.engine.mi, self.engine.dr
        # octahedral map: no trigonometry
        flat = 1 / (dr.abs(way.x) + dr.abs(way.y) + dr.abs(way.z))
        x, y = way.x * flat, way.y * flat
        below = way.z < 0
        fold_x, fold_y = (1 - dr.abs(y)) * dr.sign(x), (1 - dr.abs(x)) * dr.sign(y)
        x, y = dr.select(below, fold_x, x), dr.select(below, fold_y, y)
        column = dr.minimum(mi.UInt32((x * 0.5 + 0.5) * SKY_CELLS), SKY_CELLS - 1)
        row = dr.minimum(mi.UInt32((y * 0.5 + 0.5) * SKY_CELLS), SKY_CELLS - 1)
        return dr.gather(mi.Color3f, self.sky, row * SKY_CELLS + column)

    def _view_out(self, way: Any) -> Any:
        """Return the radiance of the outside in a direction, sharply: as a view."""
        mi, dr = self.engine.mi, self.engine.dr
        x = dr.atan2(way.x, way.y) * dr.inv_two_pi + 0.5
        return mi.Color3f(self.outside.eval(mi.Point2f(x, dr.safe_acos(way.z) * dr.inv_pi)))

    def _pane_pdf(self, ray: Any, pane: Any, active: Any) -> Any:
        """Return the density, by solid angle, of asking for the pane's point that a ray meets."""
        mi, dr = self.engine.mi, self.engine.dr
        c = dr.gather(mi.Vector3f, self.centre, pane, active)
        n = dr.gather(mi.Vector3f, self.n, pane, active)
        area = dr.gather(mi.Float, self.size, pane, active)
        cosine = -dr.dot(ray.d, n)
        far = -dr.dot(c - mi.Vector3f(ray.o), n) / dr.maximum(cosine, 1e-4)
        return dr.select(cosine > 1e-4, far * far / (dr.maximum(cosine, 1e-4) * area), 0)

    def _chance(self, room: Any, light: Any, active: Any) -> Any:
        return self.engine.dr.gather(
            self.engine.mi.Float, self.chance, room * self.lights + light, active
        )

    def _room_of(self, place: Any) -> Any:
        mi, dr = self.engine.mi, self.engine.dr
        last_column, last_row = self.columns - 1, self.rows - 1
        across = dr.clip((place.x - self.origin[0]) * self.per_metre, 0, mi.Float(last_column))
        along = dr.clip((place.y - self.origin[1]) * self.per_metre, 0, mi.Float(last_row))
        # rays that meet nothing are nowhere: NaN passes the clip, and would read beyond the table
        column = dr.minimum(mi.UInt32(across), last_column)
        row = dr.minimum(mi.UInt32(along), last_row)
        return dr.gather(mi.UInt32, self.cells, row * self.columns + column)

"""What a ray meets and how it reflects: paint over plastic or metal, from tables only."""

from dataclasses import dataclass
from typing import Any

from panoscene.synth.render._mitsuba import Engine
from panoscene.synth.render._paint import GLASS, MIRROR
from panoscene.synth.render._stage import Stage


@dataclass
class Surface:
    """Places that rays have met, one for each path."""

    place: Any
    flat: Any
    """Unit normal of the triangle, to the side that the ray came from."""
    smooth: Any
    """Unit normal between those of the corners, to the same side; without the normal map."""
    frame: Any
    """Around the shading normal, which is bent by the normal map."""
    view: Any
    """Back along the ray, in the frame."""
    colour: Any
    rough: Any
    metal: Any
    gloss: Any
    """Strength of the reflection; 0 for chalk."""
    mirror: Any
    glass: Any
    opacity: Any
    glow: Any


def meet(engine: Engine, stage: Stage, ray: Any, hit: Any, active: Any) -> Surface:
    """Return the surface at a hit, as it is seen.

    Args:
        engine: Mitsuba.
        stage: the scene.
        ray: the rays.
        hit: where they met a triangle of one of the worlds.
        active: rays that met one.
    """
    mi, dr = engine.mi, engine.dr
    face = hit.face
    corners = dr.gather(mi.Vector3u, stage.faces, face, active)
    b, c = hit.prim_uv.x, hit.prim_uv.y
    weights = (1 - b - c, b, c)
    picks = (corners.x, corners.y, corners.z)
    normal, uv = mi.Vector3f(0), mi.Point2f(0)
    for weight, corner in zip(weights, picks, strict=True):
        normal += weight * dr.gather(mi.Vector3f, stage.normals, corner, active)
        uv += weight * dr.gather(mi.Point2f, stage.uv, corner, active)
    flat = _flat_normal(engine, stage, ray, face, active)
    normal = normal * dr.rsqrt(dr.maximum(dr.squared_norm(normal), 1e-12))
    back = dr.dot(normal, flat) < 0
    normal = dr.select(back, -normal, normal)
    paint = dr.gather(mi.UInt32, stage.material, face, active)
    place = [dr.gather(mi.UInt32, stage.paint, paint * 8 + k, active) for k in range(6)]
    texel = _texture(engine, stage.texels, place[:3], uv, active)
    smooth = normal
    normal = _bent(engine, stage, place[3:], normal, uv=uv, back=back, face=face, active=active)
    # the shading normal must see the ray
    facing = dr.dot(normal, ray.d)
    normal = dr.normalize(normal - ray.d * dr.maximum(facing + 0.02, 0))
    glow = dr.gather(mi.Color3f, stage.glow, face, active & (face >= stage.first_veil))
    return _painted(
        engine, stage, ray, hit.t, paint=paint, texel=texel, normals=(flat, smooth, normal),
        glow=glow, active=active,
    )  # fmt: skip


def meet_plainly(engine: Engine, stage: Stage, ray: Any, hit: Any, active: Any) -> Surface:
    """Return the solid surface at a hit, for rays that only gather light.

    The normal of the triangle and the mean colour of its paint do for those, at a fraction of the
    time. The arguments are those of :func:`meet`.
    """
    mi, dr = engine.mi, engine.dr
    flat = _flat_normal(engine, stage, ray, hit.face, active)
    paint = dr.gather(mi.UInt32, stage.material, hit.face, active)
    mean = dr.gather(mi.UInt32, stage.paint, paint * 8 + 7, active)
    texel = [mi.Float((mean >> (8 * k)) & 255) * (1 / 255) for k in range(4)]
    facing = dr.dot(flat, ray.d)
    normal = dr.normalize(flat - ray.d * dr.maximum(facing + 0.02, 0))
    return _painted(
        engine, stage, ray, hit.t, paint=paint, texel=texel, normals=(flat, flat, normal),
        glow=mi.Color3f(0), active=active,
    )  # fmt: skip


def _flat_normal(engine: Engine, stage: Stage, ray: Any, face: Any, active: Any) -> Any:
    mi, dr = engine.mi, engine.dr
    flat = dr.gather(mi.Vector3f, stage.flat, face, active)
    return dr.select(dr.dot(flat, ray.d) > 0, -flat, flat)


def _painted(
    engine: Engine,
    stage: Stage,
    ray: Any,
    t: Any,
    *,
    paint: Any,
    texel: list[Any],
    normals: tuple[Any, Any, Any],
    glow: Any,
    active: Any,
) -> Surface:
    """Return a surface of a paint, whose colour and roughness are given as texels hold them."""
    mi, dr = engine.mi, engine.dr
    flat, smooth, normal = normals
    colour, rough = mi.Color3f(*texel[:3]), texel[3]
    # a cubic through the sRGB curve, within 0.003
    colour = colour * (colour * (colour * 0.305306 + 0.682171) + 0.012523)
    frame = mi.Frame3f(normal)
    flags = dr.gather(mi.UInt32, stage.paint, paint * 8 + 6, active)
    extra = dr.gather(mi.Point2f, stage.metal_opacity, paint, active)
    gloss = dr.clip((0.85 - rough) * 5.0, 0, 1)
    return Surface(
        ray(t),
        flat,
        smooth,
        frame,
        frame.to_local(-ray.d),
        colour,
        rough,
        extra.x,
        dr.maximum(gloss, extra.x),
        (flags & MIRROR) != 0,
        (flags & GLASS) != 0,
        extra.y,
        glow,
    )


def leave(engine: Engine, surface: Surface, way: Any) -> Any:
    """Return rays from a surface that do not meet it again at once."""
    mi, dr = engine.mi, engine.dr
    size = 1 + dr.max(dr.abs(surface.place))
    side = dr.sign(dr.dot(surface.flat, way))
    return mi.Ray3f(surface.place + surface.flat * (side * size * 5e-5), way)


def reflected(engine: Engine, s: Surface, way: Any) -> tuple[Any, Any]:
    """Return the reflectance times cosine towards a direction, and the density of sampling it.

    A Lambertian base below a GGX coat with Smith's shadowing and Schlick's Fresnel term.
    """
    mi, dr = engine.mi, engine.dr
    out = s.frame.to_local(way)
    seen, lit = dr.maximum(s.view.z, 1e-3), out.z
    half = dr.normalize(s.view + out)
    alpha2 = s.rough**4
    bump = alpha2 / (dr.pi * ((half.z * half.z) * (alpha2 - 1) + 1) ** 2)
    shadow_seen = seen + dr.sqrt(alpha2 + (1 - alpha2) * seen * seen)
    lit_safe = dr.maximum(lit, 1e-4)
    shadow_lit = lit_safe + dr.sqrt(alpha2 + (1 - alpha2) * lit_safe * lit_safe)
    meets = dr.dot(s.view, half)
    fresnel = _fresnel(engine, s, meets)
    base = s.colour * ((1 - s.metal) * dr.inv_pi) * (1 - dr.max(fresnel))
    # bump / (4 seen lit) times both shadowing terms 2 seen / shadow_seen and 2 lit / shadow_lit
    coat = fresnel * (bump / (shadow_seen * shadow_lit))
    share = _coat_share(engine, s)
    density = share * bump / (2 * shadow_seen) + (1 - share) * lit_safe * dr.inv_pi
    good = (lit > 1e-4) & (dr.dot(way, s.flat) > 0) & ~s.mirror
    value = dr.select(good, (base + coat) * lit_safe, mi.Color3f(0))
    return value, dr.select(good, density, 0)


def sample_reflection(
    engine: Engine,
    s: Surface,
    choice: Any,
    xi: Any,
) -> tuple[Any, Any, Any]:
    """Return a direction, its weight (reflectance times cosine over density) and its density.

    The coat is sampled by visible normals (Heitz 2018, "Sampling the GGX distribution of visible
    normals"). Mirrors have the density 0.
    """
    mi, dr = engine.mi, engine.dr
    alpha = s.rough * s.rough
    stretched = dr.normalize(mi.Vector3f(alpha * s.view.x, alpha * s.view.y, s.view.z))
    basis = mi.Frame3f(stretched)
    radius, turn = dr.sqrt(xi.x), dr.two_pi * xi.y
    sin_turn, cos_turn = dr.sincos(turn)
    first = radius * cos_turn
    # the disc is squeezed to what the view sees; its second axis must point up
    up = mi.Vector3f(0, 0, 1) - stretched * stretched.z
    steep = dr.squared_norm(up) > 1e-8
    second_axis = dr.select(steep, up * dr.rsqrt(dr.maximum(dr.squared_norm(up), 1e-8)), basis.t)
    first_axis = dr.cross(second_axis, stretched)
    weight = 0.5 * (1 + stretched.z)
    second = (1 - weight) * dr.safe_sqrt(1 - first * first) + weight * radius * sin_turn
    rest = dr.safe_sqrt(1 - first * first - second * second)
    bent = first_axis * first + second_axis * second + stretched * rest
    half = dr.normalize(mi.Vector3f(alpha * bent.x, alpha * bent.y, dr.maximum(bent.z, 1e-4)))
    half = dr.select(s.mirror, mi.Vector3f(0, 0, 1), half)
    shiny = 2 * dr.dot(s.view, half) * half - s.view
    height = dr.safe_sqrt(1 - xi.x)
    matt = mi.Vector3f(radius * cos_turn, radius * sin_turn, height)
    out = dr.select(s.mirror | (choice < _coat_share(engine, s)), shiny, matt)
    way = s.frame.to_world(out)
    value, density = reflected(engine, s, way)
    weight = dr.select(density > 1e-6, value / dr.maximum(density, 1e-6), mi.Color3f(0))
    weight = dr.select(s.mirror, mi.Color3f(0.88, 0.9, 0.89), weight)
    return way, weight, dr.select(s.mirror, 0, density)


def _fresnel(engine: Engine, s: Surface, cosine: Any) -> Any:
    mi, dr = engine.mi, engine.dr
    straight = mi.Color3f(0.04) * (1 - s.metal) + s.colour * s.metal
    return (straight + (1 - straight) * (1 - dr.clip(cosine, 0, 1)) ** 5) * s.gloss


def _coat_share(engine: Engine, s: Surface) -> Any:
    """Return how often the coat is sampled instead of the base."""
    dr = engine.dr
    coat = dr.max(_fresnel(engine, s, s.view.z))
    base = dr.max(s.colour) * (1 - s.metal) * (1 - coat)
    return dr.select(s.gloss > 0, dr.clip(coat / (coat + base + 1e-4), 0.1, 1.0), 0.0)


def _texture(engine: Engine, texels: Any, place: list[Any], uv: Any, active: Any) -> list[Any]:
    """Return the four channels of textures in [0, 1], between their four nearest texels."""
    mi, dr = engine.mi, engine.dr
    start, width, height = place
    x = (uv.x - dr.floor(uv.x)) * mi.Float(width) - 0.5
    y = (1 - (uv.y - dr.floor(uv.y))) * mi.Float(height) - 0.5  # rows run down
    left, top = dr.floor(x), dr.floor(y)
    right_share, low_share = x - left, y - top
    sums = [mi.Float(0)] * 4
    for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
        column, row = mi.Int32(left) + i, mi.Int32(top) + j
        wide, tall = mi.Int32(width), mi.Int32(height)
        column = dr.select(
            column < 0, column + wide, dr.select(column >= wide, column - wide, column)
        )
        row = dr.select(row < 0, row + tall, dr.select(row >= tall, row - tall, row))
        texel = dr.gather(mi.UInt32, texels, start + mi.UInt32(row * wide + column), active)
        share = (right_share if i else 1 - right_share) * (low_share if j else 1 - low_share)
        share = share * (1 / 255)
        sums = [a + share * mi.Float((texel >> (8 * k)) & 255) for k, a in enumerate(sums)]
    return sums


def _bent(
    engine: Engine,
    stage: Stage,
    place: list[Any],
    normal: Any,
    *,
    uv: Any,
    back: Any,
    face: Any,
    active: Any,
) -> Any:
    """Return the normal as the normal map bends it."""
    mi, dr = engine.mi, engine.dr
    mapped = active & (place[1] > 1)
    start, width, height = place
    x = mi.UInt32((uv.x - dr.floor(uv.x)) * mi.Float(width))
    y = mi.UInt32((1 - (uv.y - dr.floor(uv.y))) * mi.Float(height))
    x, y = dr.minimum(x, width - 1), dr.minimum(y, height - 1)
    texel = dr.gather(mi.UInt32, stage.bumps, start + y * width + x, mapped)
    red, green, blue = (mi.Float((texel >> (8 * k)) & 255) / 127 - 128 / 127 for k in range(3))
    along = mi.Vector3f(
        *(dr.gather(mi.Float, stage.tangent, face * 4 + k, mapped) for k in range(3))
    )
    sign = dr.gather(mi.Float, stage.tangent, face * 4 + 3, mapped)
    along = along - normal * dr.dot(along, normal)
    along = along * dr.rsqrt(dr.maximum(dr.squared_norm(along), 1e-12))
    up = dr.cross(normal, along) * dr.select(back, -sign, sign)
    return dr.select(mapped, dr.normalize(along * red + up * green + normal * blue), normal)

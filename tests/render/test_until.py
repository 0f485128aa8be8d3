"""Rendering until an error: the estimate is honest, the picture unbiased, and its bits do not depend on passes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.bridge.types import Scene
from gonio.errors import GonioWarning, InputError
from gonio.pictures import images
from gonio.render.finish import render_to_file
from gonio.render.prepare import prepare
from gonio.render.request import Request
from gonio.transport import until
from gonio.transport.integrators import Render, Settings, caustics
from gonio.transport.integrators.progressive import SHARE, tiles
from gonio.work import executor, kept

OPTIONS = {"size": (48, 32), "seed": 5}


def relmse(x: np.ndarray, r: np.ndarray) -> float:
    return float(np.mean((x - r) ** 2 / (r**2 + 0.01 * np.mean(r) ** 2)))


@pytest.fixture
def shared_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shares are worth it whatever they save."""
    monkeypatch.setattr(until, "MIN_SAVED", 0)
    monkeypatch.setattr(until, "MAX_GAIN", 2.0)


def drawing(scene: Path, error: float, tmp_path: Path, **options: object) -> until.Until:
    request = Request(scene, tmp_path / "a.exr", until_error=error, **OPTIONS | options)  # type: ignore[arg-type]
    found = prepare(request).render
    assert isinstance(found, until.Until)
    return found


def finish(render: until.Until, size: int = 7) -> np.ndarray:
    """Advance it to its end, by passes of a size."""
    while (goal := render.goal) > render.done:
        render.advance(min(size, goal - render.done))
    return render.image()


@pytest.mark.sample(1)
@pytest.mark.parametrize("adapts", [False, True])
def test_the_error_is_what_was_promised(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, adapts: bool
) -> None:
    monkeypatch.setattr(until, "MIN_SAVED", 0 if adapts else 10**12)
    truth = go.render(scene, spp=16384, size=(48, 32), seed=99)
    true, told = [], []
    for seed in range(6):
        render = drawing(scene, 2e-4, tmp_path, seed=seed)
        true.append(relmse(finish(render, 64), truth))
        told.append(render.estimate())
        assert told[-1] <= 2e-4
        assert ("share" in render.state()) == adapts
    assert np.mean(true) < 2e-4 * 1.3
    assert 1 / 1.3 < np.mean(true) / np.mean(told) < 1.3


def test_noise_is_told_from_two_pictures_though_single_samples_are_bright() -> None:
    rng = np.random.default_rng(2)
    truth = np.repeat(rng.uniform(0.2, 2.0, (10, 10)), 10, 0).repeat(10, 1)[..., None] * np.ones(3)

    def picture() -> np.ndarray:
        bright = rng.random((100, 100, 1)) < 0.003
        return (truth * (rng.gamma(100.0, 0.01, truth.shape) + 20.0 * (bright - 0.003))).astype(np.float32)

    pairs = [(picture(), picture()) for _ in range(8)]
    true = np.mean([relmse(0.5 * (a + b), truth) for a, b in pairs])
    assert true == pytest.approx(float(np.mean([until.squares(a, b) for a, b in pairs])), rel=0.15)


def caustic(**rest: Any) -> Scene:
    """A ring of metal on a floor, which throws a bright curve: `caustics` blurs it more than tests below allow."""
    mi = engine.load()
    t = mi.ScalarTransform4f
    eye, up = t().look_at([0, 3, 0.1], [0, 0, 0], [0, 0, 1]), t().look_at([3, 2, 0], [0, 0, 0], [0, 0, 1])
    film = {"type": "hdrfilm", "width": 40, "height": 40, "rfilter": {"type": "box"}}
    light = {"type": "area", "radiance": {"type": "rgb", "value": [15, 12, 10]}}
    metal = {"type": "twosided", "bsdf": {"type": "conductor"}}
    return mi.load_dict({
        "type": "scene",
        "sensor": {"type": "perspective", "fov": 22, "to_world": eye, "film": film},
        "floor": {"type": "rectangle", "to_world": t().rotate([1, 0, 0], -90).scale(2), "bsdf": {"type": "diffuse"}},
        "ring": {"type": "cylinder", "p0": [0, 0, 0], "p1": [0, 0.4, 0], "radius": 0.7, "bsdf": metal},
        "lamp": {"type": "rectangle", "to_world": up.scale(0.2), "emitter": light},
        **rest,
    })  # fmt: skip


def narrowing(seed: int, error: float = 0.02) -> until.Until:
    return until.Until(caustic(), Settings("caustics", 4, seed=seed), error, 1 << 12)


def test_blur_is_told_from_what_less_of_it_shows() -> None:
    """Edges between light and dark, with noise; and noise alone, of which none is blur."""
    rng = np.random.default_rng(4)
    side, parts = 48, 16  # pixels, and each of them in so many parts
    fine = rng.choice([0.2, 1.0], (12, 12)).repeat(4 * parts, 0).repeat(4 * parts, 1)
    fine = np.roll(fine, (parts // 3, parts // 2), (0, 1))

    def picture(radius: float) -> np.ndarray:
        x = np.fft.fftfreq(side * parts, 1 / side)
        kernel = np.maximum(1 - (x[:, None] ** 2 + x**2) / radius**2, 0)
        blurred = np.fft.ifft2(np.fft.fft2(kernel / kernel.sum()) * np.fft.fft2(fine)).real
        return blurred.reshape(side, parts, side, parts).mean((1, 3))[..., None] * np.ones(3)

    truth = picture(1e-3)
    for radius in (0.9, 1.5, 2.5):
        wide, narrow = picture(radius), picture(0.25 * radius)
        true = relmse(wide, truth)
        for noise in (0.0, 0.1):
            noises = noise * rng.standard_normal((4, *wide.shape))
            a, b = wide + 0.1 * noise * rng.standard_normal((2, *wide.shape))  # of fewer bright particles each
            found = until.blur_error(a, b, list(wide - narrow + noises))
            assert true / 1.4 - 4 * found.deviation < found.value < true * 1.4 + 4 * found.deviation
        nothing = until.blur_error(a, b, list(noises))
        assert abs(nothing.value) < 4 * nothing.deviation < 0.02


@pytest.mark.slow
def test_caustics_are_blurred_no_more_than_was_promised() -> None:
    scene, error, pictures = caustic(), 0.02, []
    for seed in (98, 99):
        pictures.append(Render(scene, Settings("path", 4, seed=seed)))
        pictures[-1].advance(1 << 12)
    truth = 0.5 * (pictures[0].image() + pictures[1].image())
    own = relmse(pictures[0].image(), pictures[1].image()) / 4  # the error of `truth` itself
    true = []
    for seed in range(2):
        render = narrowing(seed, error)
        true.append(relmse(finish(render, 64), truth) - own)
        assert render.estimate() <= error and render.radius < 0.6
    assert 0.5 * error < np.mean(true) < 1.3 * error
    blurred = Render(scene, Settings("caustics", 4, seed=5))
    blurred.advance(1 << 9)
    assert relmse(blurred.image(), truth) - own > 1.6 * error


def begun_anew(render: until.Until) -> np.ndarray:
    """Advance it until all has begun anew, by one sample; the picture before."""
    while True:
        before, done = render.image(), render.done
        render.advance(min(1 if render.done % 8 == 0 else 7, render.goal - render.done))
        if "narrowed" in render.state():
            assert render.done > done  # those of before count
            return before


@pytest.mark.slow
def test_what_was_too_blurred_is_shown_until_there_is_better() -> None:
    render = narrowing(1)
    before = begun_anew(render)
    assert np.array_equal(render.image(), before) and render.image().any()
    told = render.estimate()
    assert not np.array_equal(finish(render), before) and render.estimate() < told


@pytest.mark.slow
def test_one_that_began_anew_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    whole, stopped = (narrowing(1, 0.025) for _ in range(2))
    finish(whole, 64)
    begun_anew(stopped)
    for more in (0, 2):
        if more:
            stopped.advance(min(more, stopped.goal - stopped.done))
        kept.write(tmp_path / "c", {}, stopped.state())
        again = narrowing(1, 0.025)
        again.restore(stopped.done, kept.read(tmp_path / "c").arrays)
        assert np.array_equal(again.image(), stopped.image()) and again.estimate() == stopped.estimate()
        assert np.array_equal(finish(again), whole.image()) and again.done == whole.done


@pytest.mark.slow
def test_differences_are_those_of_pictures_with_less_blur_by_maps_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seen through a dark pane, whose second trips bring nothing; against half the radius, where that is less noisy."""
    monkeypatch.setattr(caustics, "INNER", 0.5)
    t = engine.load().ScalarTransform4f
    dark = {"type": "thindielectric", "specular_transmittance": {"type": "rgb", "value": 0.3}}
    place = t().translate([0, 0.45, 0]).rotate([1, 0, 0], -90).scale(0.6)
    scene = caustic(pane={"type": "rectangle", "to_world": place, "bsdf": dark})
    blurred, sharper = (Render(scene, Settings("caustics", 5, radius=r, measures=r == 2.0)) for r in (2.0, 1.0))
    blurred.advance(4)  # by one map
    first = blurred.differences()
    assert first[0].any() and not first[1].any()
    blurred.advance(4)
    assert np.allclose(blurred.differences()[0], first[0]) and blurred.differences()[1].any()
    blurred.advance(248)
    sharper.advance(256)
    seen = blurred.image() - sharper.image()
    for told in blurred.differences():
        assert np.sum(told * seen) / np.sum(seen**2) == pytest.approx(1.0, abs=0.2)
    assert sharper.differences() == []


def test_passes_of_any_size_add_up_to_the_same_bits(scene: Path, tmp_path: Path, shared_out: None) -> None:
    one, other = drawing(scene, 3e-4, tmp_path), drawing(scene, 3e-4, tmp_path)
    a, b = finish(one, 1000), finish(other, 3)
    assert one.state()["share"].min() < SHARE < one.state()["share"].max()
    assert np.array_equal(a, b) and one.done == other.done > 2 * until.FIRST


@pytest.mark.sample(1)
@pytest.mark.parametrize("at", [5, 16, 27])
def test_one_that_was_stopped_goes_on_to_the_same_bits(scene: Path, tmp_path: Path, shared_out: None, at: int) -> None:
    whole = finish(drawing(scene, 3e-4, tmp_path))
    stopped, again = drawing(scene, 3e-4, tmp_path), drawing(scene, 3e-4, tmp_path)
    while stopped.done < at:
        stopped.advance(min(3, stopped.goal - stopped.done, at - stopped.done))
    kept.write(tmp_path / "c", {}, stopped.state())
    again.restore(stopped.done, kept.read(tmp_path / "c").arrays)
    assert np.array_equal(again.image(), stopped.image())
    assert np.array_equal(finish(again), whole)
    with pytest.raises((ValueError, KeyError)):
        drawing(scene, 3e-4, tmp_path, size=(16, 16)).restore(at, stopped.state())


def test_a_checkpoint_keeps_the_error_that_was_asked_for(scene: Path, tmp_path: Path) -> None:
    whole = go.render(scene, until_error=3e-4, checkpoint=tmp_path / "c", **OPTIONS)  # type: ignore[arg-type]
    with pytest.warns(GonioWarning, match="continues from"):
        assert np.array_equal(go.resume(tmp_path / "c"), whole)
    with pytest.raises(InputError, match=r"settings: .*until_error 0.0003"):
        go.render(scene, until_error=1e-4, checkpoint=tmp_path / "c", **OPTIONS)  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_pixels_samples_do_not_follow_its_own_values(scene: Path, tmp_path: Path, shared_out: None) -> None:
    """The mean of many pictures is the picture: shares that are chosen by samples which count too have no bias."""
    truth = go.render(scene, spp=16384, size=(16, 12), integrator="direct", seed=99)
    found = np.array([
        finish(drawing(scene, 4e-3, tmp_path, size=(16, 12), seed=seed, integrator="direct"), 64) for seed in range(24)
    ])  # fmt: skip
    error = np.sqrt(found.mean((2, 3)).var(0, ddof=1).mean() / len(found) + 1e-12)
    z = (found.mean(0) - truth).mean((1, 2)) / error
    assert np.abs(z).max() < 4.5


def test_shares_follow_the_noise_and_cost_nothing() -> None:
    noise = np.ones((40, 46))
    noise[:20] = 16.0
    share, gain = until.shares(noise)
    assert share.shape == (40 * 46,) and share.mean() / SHARE == pytest.approx(1.0, abs=0.01)
    lanes = share.astype(float)[np.argsort(tiles(46, 40))].reshape(40, 46)
    assert lanes[:12].mean() / lanes[-12:].mean() == pytest.approx(4.0, rel=0.1)  # by the root of the noise
    assert gain == pytest.approx(2.5**2 / 8.5, rel=0.1)
    assert until.shares(np.zeros((8, 8)))[1] == 1.0


def test_even_noise_is_shared_evenly_also_by_a_tile_with_few_pixels() -> None:
    given, gain = until.shares(np.full((21, 17), 0.25))  # the last tile is not full
    assert len(set(given.tolist())) == 1 and gain == pytest.approx(1.0)


def test_a_bound_that_is_reached_first_is_told(scene: Path, tmp_path: Path) -> None:
    result = render_to_file(Request(scene, tmp_path / "a.exr", spp=20, until_error=1e-7))
    assert result.spp == 20 and result.stopped == "" and result.error is not None
    assert result.warnings == (
        f"relMSE is estimated to be {result.error:.3g} after 20 samples per pixel, 1e-07 was requested",
    )
    about = images.read(tmp_path / "a.exr").metadata
    assert about["until_error"] == 1e-7 and about["estimated_error"] == pytest.approx(result.error)
    with pytest.warns(GonioWarning, match="was requested"):
        go.render(scene, spp=4, until_error=1e-7)


@pytest.mark.sample(1)
@pytest.mark.parametrize("integrator", ["caustics", "light", "normal"])
def test_every_integrator_of_gonios_goes_on_until_an_error(scene: Path, tmp_path: Path, integrator: str) -> None:
    render = drawing(scene, 0.02, tmp_path, integrator=integrator, denoise=False, max_depth=None)
    assert np.isfinite(finish(render)).all() and render.estimate() <= 0.02


@pytest.mark.parametrize("error", [0.0, -1.0, float("nan"), float("inf")])
def test_an_error_that_no_picture_has_is_refused(scene: Path, error: float) -> None:
    with pytest.raises(InputError) as caught:
        go.render(scene, until_error=error)
    assert "--until-error" in str(caught.value) or "until_error" in str(caught.value)


def test_who_cannot_tell_the_error_says_so(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="gives no error estimate"):
        go.render(scene, until_error=0.1, spp=1)
    with monkeypatch.context() as other:
        other.setattr(executor, "current", lambda: type("Executor", (), {"size": 4, "remote": True})())
        with pytest.raises(InputError, match="workers render parts"):
            go.render(scene, until_error=0.1)


def test_the_seed_decides(scene: Path, tmp_path: Path) -> None:
    a, b, c = (finish(drawing(scene, 1e-3, tmp_path, seed=seed)) for seed in (1, 1, 2))
    assert np.array_equal(a, b) and not np.array_equal(a, c)

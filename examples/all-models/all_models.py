"""All models on one sheet: python examples/all-models/all_models.py [MODEL ...] writes models.jpg.

Each model is rendered on the ball of scene.json, with its defaults if these show its purpose, else as `LOOKS` says.
"""

from __future__ import annotations

import sys
from pathlib import Path

import gonio as go
import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
import sheets  # noqa: E402

PICTURE = "models.jpg"  # in the current folder
COLUMNS = 8
GOLD = "conductor(preset=Au,alpha=0.25)"
RED = "lambert(albedo=0.5,0.04,0.03)"
LOOKS = {
    "ashikhmin-shirley": "diffuse=0.03,0.07,0.25,specular=1,exponent=40,800",
    "blinn-phong": "kd=0.02,0.12,0.06,ks=0.35,p=40",
    "bump": f"base={GOLD},lean_x=0.5",
    "coat": f"base={RED}",
    "conductor": "preset=Au,alpha=0.15",
    "cook-torrance": "diffuse=0.02,0.1,0.12,specular=1,alpha=0.25",
    "dielectric": "eta=1.5,alpha=0",
    "disney": "base_color=0.6,0.12,0.02,clearcoat=1,roughness=0.5",
    "disney2015": "base_color=0.1,0.35,0.6,metallic=0.6,roughness=0.35,anisotropic=0.9",
    "eon": "albedo=0.3,0.5,0.25,roughness=1",
    "fdez-aguera": "base=conductor(preset=Au,alpha=0.6)",
    "film-conductor": "preset=Ti,alpha=0.12,film_eta=2.4,thickness=178",
    "film-dielectric": "eta=1.5,alpha=0,film_eta=1.9,thickness=400",
    "he-torrance": "diffuse=0.05,specular=1",
    "kulla-conty": "base=conductor(preset=Cu,alpha=0.6)",
    "lafortune": "diffuse=0.04,0.02,0.12,specular=0.5,exponent=12",
    "lambert": "albedo=0.75,0.25,0.1",
    "low-microfacet": "diffuse=0.12,0.03,0.05,specular=1",
    "low-smooth": "diffuse=0.04,0.08,0.03,specular=1",
    "measured": "file=PATH",
    "metal": "r0=0.9,0.45,0.3,edge=0.9,0.9,1,alpha=0.2",
    "mix": f"a={RED},b={GOLD},weight=0.5",
    "modified-phong": "kd=0.1,0.02,0.2,ks=0.3,p=60",
    "normal-map": f"base={GOLD},lean_y=0.6",
    "opacity": f"base={RED},opacity=0.35",
    "openpbr": "base_color=0.02,0.1,0.35,coat_weight=1,base_metalness=0.7,specular_roughness=0.4",
    "oren-nayar": "albedo=0.6,0.28,0.16,sigma=0.6",
    "phong": "kd=0.1,0.04,0.01,ks=0.3,p=30",
    "random-walk": "base=conductor(preset=Cu,alpha=0.6)",
    "sheen": "albedo=1,0.35,0.6,roughness=0.6",
    "sheen-charlie": "albedo=0.4,0.5,1,alpha=0.4",
    "shifted-gamma": "diffuse=0.02,0.05,0.03,specular=1",
    "sum": "a=lambert(albedo=0.02,0.15,0.05),b=conductor(eta=1.5,k=0,alpha=0.1)",
    "turquin": "base=conductor(preset=Ag,alpha=0.6)",
    "two-sided": f"base={RED}",
    "ward": "diffuse=0.02,specular=0.5,alpha=0.08,0.3",
    "ward-duer": "diffuse=0.02,specular=0.5,alpha=0.3,0.08",
}
IMAGES = {  # for models whose parameters come from images
    "bump": {"type": "conductor", "preset": "Cu", "roughness": 0.45, "bump": {"file": "heights.png", "scale": 0.12}},
    "normal-map": {"type": "conductor", "preset": "Au", "roughness": 0.45, "normalmap": {"file": "dents.png"}},
}


def material(name: str) -> go.BSDF:
    """The model as shown on the sheet."""
    if name == "measured":
        return go.Measured(HERE.parent / "three-forms" / "rough-copper.gonio")
    return go.material(f"{name}({LOOKS[name]})" if name in LOOKS else name)


def ball(name: str, size: int = 240, spp: int = 64) -> np.ndarray:
    """The picture of a model, linear."""
    return go.render(
        HERE,
        overrides={"shapes.0.material": IMAGES.get(name) or material(name)},
        size=(size, size),
        spp=spp,
        denoise=spp > 16,
    )


def main() -> None:
    names = sys.argv[1:] or list(go.models())
    cells = [(name, ball(name)) for name in names]
    print(sheets.draw(PICTURE, cells, min(COLUMNS, len(cells))))


if __name__ == "__main__":
    main()

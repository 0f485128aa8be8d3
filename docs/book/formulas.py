"""The formulas of the models, as expressions that the book typesets and tests/docs/test_formulas.py evaluates.

A formula consists of lines `name = expression` in Python syntax; the last line defines f, in 1/sr. The symbols no, ni,
nh, oh and oi are the cosines of the angles between n (normal), o (wo), i (wi) and h (half vector); vr is the cosine of
the angle between the view direction and the mirrored light direction; ox, hx, ... are components in the local frame;
f_base, f_a and f_b are values of nested materials; and E is the albedo for F = 1. All other names are parameters.
"""

from __future__ import annotations

import ast

MICROFACET = "f = albedo * F * D * G / (4 * no * ni)"
GGX = "D = alpha**2 / (pi * (nh**2 * (alpha**2 - 1) + 1)**2)"
SMITH = """\
Lambda_o = (sqrt(1 + alpha**2 * (1 - no**2) / no**2) - 1) / 2
Lambda_i = (sqrt(1 + alpha**2 * (1 - ni**2) / ni**2) - 1) / 2
G = 1 / (1 + Lambda_o + Lambda_i)"""
V_GROOVE = "G = min(1, 2 * nh * no / oh, 2 * nh * ni / oh)"
SCHLICK_5 = "F = F_0 + (1 - F_0) * (1 - oh)**5"
FRESNEL_ETA = """\
g = sqrt(eta**2 - 1 + oh**2)
F = (g - oh)**2 / (2 * (g + oh)**2) * (1 + (oh * (g + oh) - 1)**2 / (oh * (g - oh) + 1)**2)"""

RUN = {
    "lambert": "f = albedo / pi",
    "oren-nayar": """\
A = 1 - sigma**2 / (2 * (sigma**2 + 0.33))
B = 0.45 * sigma**2 / (sigma**2 + 0.09)
f = albedo / pi * (A + B * max(0, oi - no * ni) / max(no, ni))""",
    "phong": "f = kd + ks * max(0, vr)**p / ni",
    "blinn-phong": "f = kd + ks * max(0, nh)**p / ni",
    "modified-phong": "f = kd / pi + ks * (p + 2) / (2 * pi) * max(0, vr)**p",
    "conductor": f"{GGX}\n{SMITH}\nF_0 = ((eta - 1)**2 + k**2) / ((eta + 1)**2 + k**2)\n{SCHLICK_5}\n{MICROFACET}",
    "metal": f"{GGX}\n{SMITH}\nF_0 = r0\n{SCHLICK_5}\n{MICROFACET}",
    "ward": """\
e = exp(-(hx**2 / alpha_x**2 + hy**2 / alpha_y**2) / nh**2)
f = diffuse / pi + specular * e / (4 * pi * alpha_x * alpha_y * sqrt(no * ni))""",
    "ward-duer": """\
e = exp(-(hx**2 / alpha_x**2 + hy**2 / alpha_y**2) / nh**2)
f = diffuse / pi + specular * e / (4 * pi * alpha_x * alpha_y * no * ni)""",
    "lafortune": """\
c = cx * ox * ix + cy * oy * iy + cz * oz * iz
f = diffuse / pi + specular * (exponent + 2) / (2 * pi) * max(0, c)**exponent""",
    "cook-torrance": f"""\
D = exp(-(1 - nh**2) / (alpha**2 * nh**2)) / (alpha**2 * nh**4)
{V_GROOVE}
{FRESNEL_ETA}
f = diffuse / pi + specular * F * D * G / (pi * no * ni)""",
    "low-microfacet": f"""\
D = (1 + b * (1 - nh))**(-c)
{V_GROOVE}
{FRESNEL_ETA}
f = diffuse / pi + specular * F * D * G / (pi * no * ni)""",
    "sheen-charlie": "D = (2 + 1 / alpha) * sqrt(1 - nh**2)**(1 / alpha) / (2 * pi)",
    "ashikhmin-shirley": """\
F_0 = ((eta - 1) / (eta + 1))**2
F = F_0 + (1 - F_0) * (1 - oh)**5
p_h = sqrt((n_x + 1) * (n_y + 1)) / (2 * pi) * nh**((n_x * hx**2 + n_y * hy**2) / (1 - nh**2))
f = diffuse / pi + specular * F * p_h / (4 * oh * max(no, ni))""",
    "kulla-conty": """\
f_ms = (1 - E_o) * (1 - E_i) / (pi * (1 - E_avg))
f_add = F_avg * E_avg / (1 - F_avg * (1 - E_avg))
f = f_base + f_add * f_ms""",
    "turquin": "f = f_base * (1 + F_0 * (1 - E_o) / E_o)",
    "mix": "f = (1 - weight) * f_a + weight * f_b",
    "sum": "f = f_a + f_b",
}

# formulas without a closed form in the directions: they depend on other materials, tables or random numbers
SET = {
    "dielectric": [
        r"f_r = \frac{F\, D\, G}{4\, (n\cdot o)(n\cdot i)}",
        r"f_t = \frac{|o\cdot m|\,|i\cdot m|\,(1-F)\, D\, G}{|o\cdot n|\,|i\cdot n|\,(o\cdot m+\eta\, i\cdot m)^2}",
    ],
    "sheen-charlie": [
        r"f = \frac{\mathrm{albedo}\; D\, G}{4\,(n\cdot o)(n\cdot i)}",
        r"G = \frac{1}{1+\Lambda(\mu_o)+\Lambda(\mu_i)}",
    ],
    "sheen": [r"f \cos\theta_i = \mathrm{albedo}\; R(o)\, D(o, i)"],
    "eon": [
        r"f = \frac{\rho}{\pi} A \left(1 + r \frac{s}{t}\right)"
        r" + \frac{\rho_{ms}}{\pi}\, \frac{(1-E(\mu_o))(1-E(\mu_i))}{1-E_{avg}}",
        r"s = o\cdot i - \mu_o \mu_i, \quad t = \max(\mu_o, \mu_i) \text{ where } s>0 \text{, else } 1",
        r"A = \frac{1}{1 + \left(\frac12 - \frac{2}{3\pi}\right) r}, \quad"
        r" \rho_{ms} = \frac{\rho^2 E_{avg}}{1-\rho\,(1-E_{avg})}",
    ],
    "kulla-conty": [
        r"E_{avg} = 2\int_0^1 E(\mu)\,\mu\, d\mu, \quad F_{avg} = 2\int_0^1 F(\mu)\,\mu\, d\mu",
    ],
    "fdez-aguera": [
        r"f = f_{base} + \frac{F_{ms}\, E_{ms}}{\pi}",
        r"F_{ms} = \frac{F_{ss}E_{ss}\, F_{avg}}{1-E_{ms}F_{avg}}, \quad E_{ms} = 1-(A+B), \quad"
        r" F_{avg} = F_0 + \frac{1-F_0}{21}",
    ],
    "random-walk": [r"f = f_{base} + \left\langle f_{2+} \right\rangle"],
    "mirror": [r"o = 2\,(n\cdot i)\, n - i, \quad \theta_o = \theta_i, \quad \phi_o = \phi_i + \pi"],
    "thin-dielectric": [r"R' = R + T^2R + T^2R^3 + \dots = \frac{2R}{1+R}, \quad T' = 1-R'"],
    "film-conductor": [r"f = \frac{\mathrm{albedo}\; F_{film}\, D\, G}{4\,(n\cdot o)(n\cdot i)}"],
    "film-dielectric": [r"f_r = \frac{F_{film}\, D\, G}{4\,(n\cdot o)(n\cdot i)}, \quad f_t \propto 1-F_{film}"],
    "coat": [
        r"f = f_{top} + \frac{T(o)\,T(i)\,t(o')\,t(i')}{\eta^2}\, g\, f_{base}(o', i')"
        r" + \frac{\mathrm{rest}(o)\,\mathrm{rest}(i)}{\mathrm{norm}}"
    ],
    "disney": [
        r"f = (1-\mathrm{metallic})\left(\frac{\mathrm{base}}{\pi}\,\mathrm{mix}(f_d, f_{ss}, \mathrm{subsurface})"
        r" + f_{sheen}\right) + \frac{F D G}{4\,(n\cdot o)(n\cdot i)} + \frac{\mathrm{clearcoat}}{4} f_r",
        r"f_d = \left(1+(F_{D90}-1)(1-n\cdot i)^5\right)\left(1+(F_{D90}-1)(1-n\cdot o)^5\right), \quad"
        r" F_{D90} = \frac12 + 2\,\mathrm{roughness}\,(i\cdot h)^2",
    ],
    "disney2015": [
        r"f = \mathrm{coat} + (1-E_{coat})\left[\mathrm{metallic}\; f_{metal}"
        r" + (1-\mathrm{metallic})\, f_{dielectric}\right]"
    ],
    "openpbr": [
        r"f = \mathrm{opacity}\left\{F f_{fuzz}"
        r" + (1-F E_{fuzz})\left[C f_{coat} + (1-C+C\,T\,W\,D)\, f_{base}\right]\right\}",
        r"f_{base} = M f_{metal} + (1-M)\left\{f_{glossy}"
        r" + \frac{(1-E_o)(1-E_i)}{1-E_{avg}}\, f_{diffuse}\right\}",
    ],
    "he-torrance": [
        r"f = \frac{\mathrm{diffuse}}{\pi} + \mathrm{specular}\,\frac{F\,S\,G\,D}{\pi\,(n\cdot o)(n\cdot i)}",
        r"D = \left(\frac{\pi\tau}{2\lambda}\right)^2 \sum_{m=1}^{\infty} \frac{g^m e^{-g}}{m\; m!}"
        r" \exp\left(-\frac{(\pi\tau v/\lambda)^2}{m}\right), \quad"
        r" g = \left(\frac{2\pi s}{\lambda}(n\cdot o+n\cdot i)\right)^2",
    ],
    "low-smooth": [r"f = \frac{\mathrm{diffuse}}{\pi} + \mathrm{specular}\,\left(1+b\,|D_p|^2\right)^{-c} F"],
    "shifted-gamma": [
        r"f = \frac{\mathrm{diffuse}}{\pi} + \mathrm{specular}\,\frac{F D G}{\pi\,(n\cdot o)(n\cdot i)}",
        r"D = \frac{\mathrm{normalization}\; e^{-x}}{x^p\,\pi\cos^4\theta_h}, \quad"
        r" x = \alpha + \frac{\tan^2\theta_h}{\alpha}",
    ],
    "two-sided": [r"f(o, i) = f_{base}(\pm o, \pm i)"],
    "opacity": [r"f = \mathrm{opacity}\; f_{base} + (1-\mathrm{opacity})\,\frac{\delta(i+o)}{|\cos\theta_i|}"],
    "normal-map": [r"f\cos\theta_i = b(o, i) + b(o, -i), \quad n' \propto (\mathrm{lean}_x, \mathrm{lean}_y, 1)"],
    "bump": [r"n' \propto (-g, 1), \quad g = \left(\frac{h_u}{l},\; \frac{h_v - s\,h_u/l}{m}\right)"],
    "measured": [r"f(\theta_h, \theta_d, \phi_d) \text{ interpolated in the table's own coordinates}"],
}

NAMES = {
    "no": r"(n\cdot o)", "ni": r"(n\cdot i)", "nh": r"(n\cdot h)", "oh": r"(o\cdot h)", "oi": r"(o\cdot i)",
    "vr": r"(v\cdot r)",
    "hx": "h_x", "hy": "h_y", "ox": "o_x", "oy": "o_y", "oz": "o_z", "ix": "i_x", "iy": "i_y", "iz": "i_z",
    "kd": "k_d", "ks": "k_s", "cx": "C_x", "cy": "C_y", "cz": "C_z", "r0": "r_0", "p_h": "p_h",
    "pi": r"\pi", "alpha": r"\alpha", "sigma": r"\sigma", "eta": r"\eta",
    "alpha_x": r"\alpha_x", "alpha_y": r"\alpha_y",
    "f_base": r"f_{base}", "f_add": r"f_{add}", "f_ms": r"f_{ms}", "F_avg": r"F_{avg}",
    "E_o": r"E(\mu_o)", "E_i": r"E(\mu_i)", "E_avg": r"E_{avg}",
    "Lambda_o": r"\Lambda(o)", "Lambda_i": r"\Lambda(i)",
}  # fmt: skip
FUNCTIONS = {"max": r"\max", "min": r"\min", "exp": r"\exp"}


def of_model(name: str) -> list[str]:
    """The formulas of a model in LaTeX, one per line; empty if the model has none."""
    lines = [latex(line) for line in RUN.get(name, "").splitlines()]
    return SET.get(name, []) + lines


def latex(line: str) -> str:
    """The line `name = expression` in LaTeX."""
    statement = ast.parse(line).body[0]
    if not (isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name)):
        raise ValueError(f"a line of a formula must be NAME = EXPRESSION, not: {line}")
    return f"{_latex(statement.targets[0])} = {_latex(statement.value)}"


def _latex(node: ast.expr) -> str:
    match node:
        case ast.Name(name):
            return NAMES.get(name) or (name if len(name) == 1 or name[1:2] == "_" else rf"\mathrm{{{name}}}")
        case ast.Constant(value):
            return str(value)
        case ast.UnaryOp(ast.USub(), operand):
            return f"-{_latex(operand)}"
        case ast.BinOp(left, ast.Div(), right):
            return rf"\frac{{{_latex(left)}}}{{{_latex(right)}}}"
        case ast.BinOp(left, ast.Pow(), right):
            return f"{_base(left)}^{{{_latex(right)}}}"
        case ast.BinOp(left, ast.Mult(), right):
            return rf"{_factor(left)}\, {_factor(right)}"
        case ast.BinOp(left, ast.Add(), right):
            return f"{_latex(left)} + {_latex(right)}"
        case ast.BinOp(left, ast.Sub(), right):
            return f"{_latex(left)} - {_factor(right)}"
        case ast.Call(ast.Name("sqrt"), [argument]):
            return rf"\sqrt{{{_latex(argument)}}}"
        case ast.Call(ast.Name(name), arguments):
            return rf"{FUNCTIONS[name]}\left({', '.join(map(_latex, arguments))}\right)"
    raise ValueError(f"no LaTeX for {ast.unparse(node)}")


def _factor(node: ast.expr) -> str:
    added = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)
    return rf"\left({_latex(node)}\right)" if added else _latex(node)


def _base(node: ast.expr) -> str:
    single = isinstance(node, ast.Name | ast.Constant)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id != "sqrt":
        single = True
    return _latex(node) if single else rf"\left({_latex(node)}\right)"

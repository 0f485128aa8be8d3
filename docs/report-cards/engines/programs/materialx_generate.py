"""Write MaterialX's generated GLSL of a surface as a shader that Gonio reads, with its adapter.

    pip install MaterialX==1.39.5
    python materialx_generate.py FOLDER     writes standard-surface.glsl and open-pbr-surface.glsl, each with its .toml

What is changed in the generated text: uniforms and vertex data become variables, and the one light has intensity 1 and
the direction that is asked for. The text itself comes from the package.
"""

import re
import sys
from pathlib import Path

import MaterialX as mx
import MaterialX.PyMaterialXGenGlsl as glsl
import MaterialX.PyMaterialXGenShader as generator

# node -> our parameter: input, default, low, high
NODES = {
    "standard_surface": {
        "color": ("base_color", None, 0.0, 1.0),
        "base": ("base", 1.0, 0.0, 1.0),
        "metalness": ("metalness", 0.0, 0.0, 1.0),
        "rough": ("specular_roughness", 0.5, 0.0, 1.0),
        "ior": ("specular_IOR", 1.5, 1.0, 3.0),
        "coat": ("coat", 0.0, 0.0, 1.0),
        "coatRough": ("coat_roughness", 0.5, 0.0, 1.0),
        "sheen": ("sheen", 0.0, 0.0, 1.0),
        "sheenRough": ("sheen_roughness", 0.5, 0.0, 1.0),
    },
    "open_pbr_surface": {
        "color": ("base_color", None, 0.0, 1.0),
        "metalness": ("base_metalness", 0.0, 0.0, 1.0),
        "rough": ("specular_roughness", 0.5, 0.0, 1.0),
        "ior": ("specular_ior", 1.5, 1.0, 3.0),
        "coat": ("coat_weight", 0.0, 0.0, 1.0),
        "coatRough": ("coat_roughness", 0.5, 0.0, 1.0),
        "fuzz": ("fuzz_weight", 0.0, 0.0, 1.0),
        "fuzzRough": ("fuzz_roughness", 0.5, 0.0, 1.0),
    },
}


def generated(node: str) -> str:
    """The pixel shader of a node at its default values, for one directional light and no environment."""
    path, library, document = mx.getDefaultDataSearchPath(), mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), path, library)
    document.setDataLibrary(library)
    material = document.addMaterialNode("made", document.addNode(node, "surf", "surfaceshader"))
    shading = glsl.GlslShaderGenerator.create()
    context = generator.GenContext(shading)
    context.registerSourceCodeSearchPath(path)
    options = context.getOptions()
    options.hwMaxActiveLightSources = 1
    options.hwSpecularEnvironmentMethod = generator.HwSpecularEnvironmentMethod.SPECULAR_ENVIRONMENT_NONE
    options.shaderInterfaceType = generator.ShaderInterfaceType.SHADER_INTERFACE_COMPLETE
    generator.HwShaderGenerator.bindLightShader(library.getNodeDef("ND_directional_light"), 1, context)
    return shading.generate("made", material, context).getSourceCode("pixel")


def adapted(text: str, parameters: dict) -> str:
    """The text with a function of both directions and the parameters in place of its uniforms and inputs."""
    for pattern, new in (
        (r"uniform (surfaceshader|displacementshader) \w+;\n", ""),
        (r"in VertexData\n\{(.*?)\} vd;", r"struct VertexData {\1};\nVertexData vd;\nvec3 givenLight;"),
        (r"uniform (float|bool|int|vec3) (\w+)( = [^;]*)?;", r"\1 \2\3;"),
        (r"sampleLightSource\(u_lightData[^;]*;", "lightShader = lightshader(vec3(1.0), givenLight);"),
        (r"u_numActiveLightSources = 0;", "u_numActiveLightSources = 1;"),
        (r"out vec4 out1;", "vec4 out1;\nbool u_refractionTwoSided = false;"),
        (r"uniform LightData", "LightData"),
        (r"fwidth\(N\)", "vec3(0.0)"),  # a flat surface
        (r"fwidth\(P\)", "vec3(1.0)"),
    ):
        text = re.sub(pattern, new, text, flags=re.DOTALL)
    given = ", ".join(f"{'vec3' if name == 'color' else 'float'} {name}" for name in parameters)
    lines = [f"    surf_{one[0]} = {name};" for name, one in parameters.items()]
    return "\n".join(
        [
            text,
            f"vec3 surface(vec3 light, vec3 view, {given}) {{",
            *lines,
            "    vd.normalWorld = vec3(0.0, 0.0, 1.0);",
            "    vd.tangentWorld = vec3(1.0, 0.0, 0.0);",
            "    vd.positionWorld = vec3(0.0);",
            "    u_viewPosition = view;",
            "    givenLight = light;",
            "    main();",
            "    return out1.rgb;",
            "}",
            "",
        ]
    )


def adapter(node: str, parameters: dict) -> str:
    """The adapter of a shader."""
    meanings = ", ".join(['"light"', '"view"', *['"parameter"'] * len(parameters)])
    lines = [f'doc = "{node} of MaterialX"', 'function = "surface"', f"arguments = [{meanings}]", "cosine = true"]
    for name, (meaning, default, low, high) in parameters.items():
        value = "[1.0, 1.0, 1.0]" if default is None else default
        lines += ["", f"[parameters.{name}]", f"default = {value}", f"low = {low}", f"high = {high}"]
        lines += [f'doc = "{meaning}"']
    return "\n".join(lines) + "\n"


def write(folder: Path) -> None:
    """Both surfaces into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for node, parameters in NODES.items():
        path = folder / f"{node.replace('_', '-')}.glsl"
        path.write_text(adapted(generated(node), parameters))
        Path(f"{path}.toml").write_text(adapter(node, parameters))
        print(path)


if __name__ == "__main__":
    write(Path(sys.argv[1]))

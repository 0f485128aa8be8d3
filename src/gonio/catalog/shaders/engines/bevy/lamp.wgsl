// StandardMaterial of Bevy under one directional light of illuminance 1, for a flat surface: the LightingInput of
// `apply_pbr_lighting`, and the computation of `directional_light`, with the functions of the engine.
#define_import_path gonio::lamp

#import bevy_pbr::lighting::{LightingInput, derive_lighting_input, Fd_Burley, F_AB, perceptualRoughnessToRoughness}
#import bevy_pbr::lighting::{specular, specular_anisotropy, specular_clearcoat}
#import bevy_pbr::pbr_functions::{calculate_diffuse_color, calculate_F0_dielectric}

struct Surface {
    color: vec3f,
    rough: f32,
    metal: f32,
    reflectance: f32,
    coat: f32,
    coatRough: f32,
    strength: f32,
}

fn lamp(L: vec3f, V: vec3f, given: Surface) -> vec3f {
    let N = vec3f(0.0, 0.0, 1.0);
    let alpha = perceptualRoughnessToRoughness(given.rough);
    var surface: LightingInput;
    surface.layers[0].N = N;
    surface.layers[0].R = reflect(-V, N);
    surface.layers[0].NdotV = max(V.z, 0.0001);
    surface.layers[0].perceptual_roughness = given.rough;
    surface.layers[0].roughness = alpha;
    surface.V = V;
    surface.diffuse_color = calculate_diffuse_color(given.color, given.metal, 0.0, 0.0);
    surface.metallic = given.metal;
    surface.F0_dielectric = calculate_F0_dielectric(vec3f(given.reflectance));
    surface.F0_metallic = given.color;
    surface.F_ab = F_AB(given.rough, surface.layers[0].NdotV);
#ifdef STANDARD_MATERIAL_ANISOTROPY
    surface.anisotropy = given.strength;
    surface.Ta = vec3f(1.0, 0.0, 0.0);
    surface.Ba = vec3f(0.0, 1.0, 0.0);
#endif
    var derived = derive_lighting_input(N, V, L);
    let base = surface.diffuse_color * Fd_Burley(&surface, &derived);
#ifdef STANDARD_MATERIAL_ANISOTROPY
    let gloss = specular_anisotropy(&surface, &derived, L, alpha, 1.0);
#else
    let gloss = specular(&surface, &derived, alpha, 1.0);
#endif
#ifdef STANDARD_MATERIAL_CLEARCOAT
    let layer = specular_clearcoat(&surface, &derived, given.coat, perceptualRoughnessToRoughness(given.coatRough), 1.0);
    let passed = 1.0 - layer.x;
    return ((base + gloss * passed) * passed + layer.y) * derived.NdotL;
#else
    return (base + gloss) * derived.NdotL;
#endif
}

// StandardMaterial of Bevy with clear coat.
#import gonio::lamp::{Surface, lamp}

fn coated(L: vec3f, V: vec3f, color: vec3f, rough: f32, metal: f32, reflectance: f32, coat: f32, coatRough: f32) -> vec3f {
    return lamp(L, V, Surface(color, rough, metal, reflectance, coat, coatRough, 0.0));
}

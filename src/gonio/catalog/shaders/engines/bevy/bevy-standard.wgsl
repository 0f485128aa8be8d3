// StandardMaterial of Bevy.
#import gonio::lamp::{Surface, lamp}

fn standard(L: vec3f, V: vec3f, color: vec3f, rough: f32, metal: f32, reflectance: f32) -> vec3f {
    return lamp(L, V, Surface(color, rough, metal, reflectance, 0.0, 0.0, 0.0));
}

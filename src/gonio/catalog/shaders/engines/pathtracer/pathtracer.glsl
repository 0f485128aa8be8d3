// three-gpu-pathtracer: bsdfResult and bsdfSample of an opaque surface, at the first hit of a path. Its random
// numbers are the arguments: u.z chooses the lobe, u.xy the direction.

#include <defines>

vec3 given;
vec2 rand2( int stream ) { return given.xy; }
float rand( int stream ) { return given.z; }

#include <shader/structs/surface_record_struct>
#include <shader/common/math_functions>
#include <shader/common/util_functions>
#include <shader/common/fresnel_functions>
#include <shader/sampling/shape_sampling_functions>
#include <shader/bsdf/ggx_functions>
#include <shader/bsdf/sheen_functions>
#include <shader/bsdf/iridescence_functions>
#include <shader/bsdf/bsdf_functions>

uniform vec3 color;
uniform float roughness;
uniform float metalness;
uniform float ior;
uniform float clearcoat;
uniform float clearcoatRoughness;
uniform float sheen;
uniform float sheenRoughness;

SurfaceRecord surface() {
	SurfaceRecord surf;
	surf.volumeParticle = false;
	surf.frontFace = true;
	surf.faceNormal = surf.normal = surf.clearcoatNormal = vec3( 0.0, 0.0, 1.0 );
	surf.normalBasis = surf.normalInvBasis = surf.clearcoatBasis = surf.clearcoatInvBasis = mat3( 1.0 );
	surf.ior = ior;
	surf.eta = 1.0 / ior;
	surf.f0 = iorRatioToF0( surf.eta );
	surf.color = color;
	surf.metalness = metalness;
	surf.roughness = surf.filteredRoughness = square( roughness );
	surf.transmission = 0.0;
	surf.thinFilm = false;
	surf.clearcoat = clearcoat;
	surf.clearcoatRoughness = surf.filteredClearcoatRoughness = square( clearcoatRoughness );
	surf.sheen = sheen;
	surf.sheenColor = vec3( 1.0 );
	surf.sheenRoughness = sheenRoughness;
	surf.iridescence = 0.0;
	surf.iridescenceIor = 1.3;
	surf.iridescenceThickness = 400.0;
	surf.specularColor = vec3( 1.0 );
	surf.specularIntensity = 1.0;
	return surf;
}

struct Drawn {
	vec3 wi;
	vec3 weight;
	float pdf;
};

vec3 pathtracer( vec3 light, vec3 view ) {
	vec3 value = vec3( 0.0 );
	bsdfResult( view, light, surface(), value );
	return value;
}

float pathtracer_pdf( vec3 light, vec3 view ) {
	vec3 value = vec3( 0.0 );
	return bsdfResult( view, light, surface(), value );
}

Drawn pathtracer_sample( vec3 view, vec3 u ) {
	given = u;
	ScatterRecord record = bsdfSample( view, surface() );
	return Drawn( record.direction, record.pdf > 0.0 ? record.color / record.pdf : vec3( 0.0 ), record.pdf );
}

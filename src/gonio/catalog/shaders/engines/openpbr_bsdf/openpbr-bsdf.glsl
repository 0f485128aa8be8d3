// openpbr-bsdf of Adobe: openpbr_eval of an opaque surface with coat and fuzz. Its tables are textures. Sampling and
// density are omitted, because openpbr_sample uses the bits of a lobe's type, which Gonio does not support.

uniform sampler3D ideal_dielectric_energy_complement;
uniform sampler2D ideal_dielectric_avg_energy_complement;
uniform sampler2D ideal_dielectric_reflection_ratio;
uniform sampler3D opaque_dielectric_energy_complement;
uniform sampler2D opaque_dielectric_avg_energy_complement;
uniform sampler2D ideal_metal_energy_complement;
uniform sampler2D ideal_metal_avg_energy_complement;
uniform sampler2D ltc;

vec4 table2( int id, vec2 uv ) {
	if ( id == 1 ) return texture( ideal_dielectric_avg_energy_complement, uv );
	if ( id == 2 ) return texture( ideal_dielectric_reflection_ratio, uv );
	if ( id == 4 ) return texture( opaque_dielectric_avg_energy_complement, uv );
	if ( id == 5 ) return texture( ideal_metal_energy_complement, uv );
	if ( id == 6 ) return texture( ideal_metal_avg_energy_complement, uv );
	return texture( ltc, uv );
}

vec4 table3( int id, vec3 uvw ) {
	if ( id == 0 ) return texture( ideal_dielectric_energy_complement, uvw );
	return texture( opaque_dielectric_energy_complement, uvw );
}

#define OPENPBR_USE_TEXTURE_LUTS 1
#define OPENPBR_SAMPLE_2D_TEXTURE(id, uv) table2(id, uv)
#define OPENPBR_SAMPLE_3D_TEXTURE(id, uvw) table3(id, uvw)
#define OPENPBR_LANGUAGE_TARGET_GLSL 1

// a function of other languages, called by the GLSL version
float atan2( float y, float x ) { return atan( y, x ); }

#include "openpbr.h"

uniform vec3 color;
uniform float metalness;
uniform float diffuseRoughness;
uniform float roughness;
uniform float ior;
uniform float coat;
uniform float coatRoughness;
uniform float coatIor;
uniform float fuzz;
uniform float fuzzRoughness;

OpenPBR_PreparedBsdf prepared( vec3 view ) {
	OpenPBR_ResolvedInputs inputs = openpbr_make_default_resolved_inputs();
	inputs.base_color = color;
	inputs.base_metalness = metalness;
	inputs.base_diffuse_roughness = diffuseRoughness;
	inputs.specular_roughness = roughness;
	inputs.specular_ior = ior;
	inputs.coat_weight = coat;
	inputs.coat_roughness = coatRoughness;
	inputs.coat_ior = coatIor;
	inputs.fuzz_weight = fuzz;
	inputs.fuzz_roughness = fuzzRoughness;
	return openpbr_prepare( inputs, vec3( 1.0 ), OpenPBR_BaseRgbWavelengths_nm, OpenPBR_VacuumIor, view );
}

vec3 openpbr( vec3 light, vec3 view ) {
	return openpbr_get_sum_of_diffuse_specular( openpbr_eval( prepared( view ), light ) );
}

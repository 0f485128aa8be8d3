// The clustered forward renderer of Godot for one directional light of irradiance 1 on a flat surface: the engine's
// `light_compute`, then the final colors of its fragment program. Roughness and metallic are not rounded to 8 bits.

#define M_PI 3.14159265359
#define SPECULAR_SCHLICK_GGX
#define sampler2D( image, sampling ) image

uniform sampler2D dfg;

#ifdef GODOT_HALF
#include <half_inc.glsl>
#else
#define half float
#define hvec3 vec3
#endif

#ifdef GODOT_PACKED
vec4 orms_of_surface; // occlusion, roughness, metallic, specular
#define unpackUnorm4x8( packed ) orms_of_surface
#endif

#include <scene_forward_lights_inc.glsl#D_GGX,V_GGX,D_GGX_anisotropic,V_GGX_anisotropic,SchlickFresnel,F0,light_compute>
#ifdef GODOT_COMPENSATION
#include <forward_clustered/scene_forward_clustered_inc.glsl#prefiltered_dfg,get_energy_compensation>
#endif

vec3 lamp( vec3 L, vec3 V, vec3 albedo, float roughness, float metallic, float specular, float coat, float coat_roughness, float anisotropy ) {
	vec3 N = vec3( 0.0, 0.0, 1.0 );
	vec3 f0 = F0( metallic, specular, albedo );
	vec3 diffuse = vec3( 0.0 );
	vec3 reflected = vec3( 0.0 );
	float alpha = 1.0;
#ifdef GODOT_PACKED
	orms_of_surface = vec4( 1.0, roughness, metallic, specular );
#endif
	light_compute( N, L, V, 0.0, vec3( 1.0 ), true, 1.0, f0,
#ifdef GODOT_PACKED
		0u,
#else
		roughness, metallic,
#endif
		1.0, albedo, alpha,
#ifdef GODOT_SCREEN
		vec2( 0.0 ),
#endif
#ifdef GODOT_COMPENSATION
		get_energy_compensation( f0, prefiltered_dfg( roughness, clamp( V.z, 0.0001, 1.0 ) ).y ),
#endif
#ifdef LIGHT_CLEARCOAT_USED
		coat, coat_roughness, N,
#endif
#ifdef LIGHT_ANISOTROPY_USED
		vec3( 0.0, 1.0, 0.0 ), vec3( 1.0, 0.0, 0.0 ), anisotropy,
#endif
		diffuse, reflected );
	return diffuse * albedo * ( 1.0 - metallic ) + reflected;
}

// The loop over lights in `pbrShader` of glTF-Sample-Viewer for a flat surface and one light of irradiance 1, with the
// BRDFs of the package: F mixes the diffuse and specular lobes of a dielectric, which is then mixed with the metal.

#define M_PI 3.141592653589793

#include <gltf-viewer.module.js#brdfShader>

vec3 lamp( vec3 light, vec3 view, vec3 color, float rough, float metal, float strength ) {
	vec3 n = vec3( 0.0, 0.0, 1.0 );
	vec3 h = normalize( light + view );
	float NdotL = clamp( light.z, 0.0, 1.0 );
	float NdotV = clamp( view.z, 0.0, 1.0 );
	float NdotH = clamp( h.z, 0.0, 1.0 );
	float VdotH = clamp( dot( view, h ), 0.0, 1.0 );
	float alpha = rough * rough;
	#ifdef MATERIAL_ANISOTROPY
	vec3 lobe = BRDF_specularGGXAnisotropy( alpha, strength, n, view, light, h, vec3( 1.0, 0.0, 0.0 ), vec3( 0.0, 1.0, 0.0 ) );
	#else
	vec3 lobe = BRDF_specularGGX( alpha, NdotL, NdotV, NdotH );
	#endif
	vec3 ofMetal = F_Schlick( color, vec3( 1.0 ), VdotH ) * lobe;
	vec3 ofDielectric = mix( BRDF_lambertian( color ), lobe, F_Schlick( vec3( 0.04 ), vec3( 1.0 ), VdotH ) );
	return NdotL * mix( ofDielectric, ofMetal, metal );
}

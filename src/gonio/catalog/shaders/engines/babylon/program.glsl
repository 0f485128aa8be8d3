// The fragment program of PBRMaterial of Babylon.js for a flat surface, lit by one directional light of irradiance 1,
// with linear output colors: the definitions of the material's class, then the unchanged text of the package. Uniforms
// and varyings become globals, which Gonio's function assigns before it calls the program's main.

#define PBR
#define METALLICWORKFLOW
#define SPECULARTERM
#define NORMAL
#define LIGHT0
#define DIRLIGHT0
#define USEPHYSICALLIGHTFALLOFF
#define ENVIRONMENTBRDF
#define BRDF_V_HEIGHT_CORRELATED
#define MS_BRDF_ENERGY_CONSERVATION
#define SPECULAR_GLOSSINESS_ENERGY_CONSERVATION
#define BASE_DIFFUSE_MODEL 0
#define DIELECTRIC_SPECULAR_MODEL 0
#define CONDUCTOR_SPECULAR_MODEL 0
#define IMAGEPROCESSINGPOSTPROCESS
#define SKIPFINALCOLORCLAMP

#define gl_FragColor programColor
#undef varying
#define varying
#define uniform

vec4 programColor;

#include <pbr.fragment>

vec3 lit( vec3 light, vec3 view, vec3 color, float rough, float metal, float index ) {
	float r = ( index - 1.0 ) / ( index + 1.0 );
	vEyePosition = vec4( view, 1.0 );
	vPositionW = vec3( 0.0 );
	vNormalW = vec3( 0.0, 0.0, 1.0 );
	vAlbedoColor = vec4( color, 1.0 );
	baseWeight = 1.0;
	baseDiffuseRoughness = 0.0;
	vLightingIntensity = vec4( 1.0 );
	vReflectivityColor = vec4( metal, rough, index, r * r );
	vMetallicReflectanceFactors = vec4( 1.0 );
	vEmissiveColor = vec3( 0.0 );
	vAmbientColor = vec3( 0.0 );
	visibility = 1.0;
	light0.vLightData = vec4( - light, 1.0 );
	light0.vLightDiffuse = vec4( 1.0 );
	light0.vLightSpecular = vec4( 1.0, 1.0, 1.0, 0.00001 );
	main();
	return programColor.rgb;
}

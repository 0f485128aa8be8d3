// The members of the uniform buffer of a directional light.
struct Light { vec4 vLightData; vec4 vLightDiffuse; vec4 vLightSpecular; };
Light light{X};

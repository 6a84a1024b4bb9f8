// A vertex of a character as the light sees it.

layout(location = 0) in vec3 quantized_place;

uniform vec3 low, size;
uniform mat4 to_light;

void main()
{
    gl_Position = to_light * vec4(low + size * quantized_place, 1.0);
}

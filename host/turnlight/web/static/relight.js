// Draws a material under a point light with WebGL2, beside a second material or a photograph.

import { BRDF } from "turnlight/brdf.js";
import { mipChain } from "turnlight/maps.js";

export const SHOWN = ["relit", "normal", "diffuse", "roughness", "specular"];

const VERTEX = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
${BRDF}
uniform sampler2D normalMap, diffuseMap, specularMap;  // roughness is the normal's alpha
uniform sampler2D otherNormalMap, otherDiffuseMap, otherSpecularMap;
uniform sampler2D photo, white;
uniform mat3 plane;  // from the canvas's pixels to the sample, in half sides, homogeneous
uniform vec2 extent;
uniform float repeats;
uniform vec3 light, view, ground;
uniform float power;     // irradiance is pi power / distance^2, or pi white if there is a white map
uniform bool hasWhite;
uniform float exposure;
uniform float split;     // left of this x the other side is shown
uniform int other;       // what that is: 0 nothing, 1 the other material, 2 the photograph
uniform int shown;
out vec4 colour;

vec3 encode(vec3 linear) {
  return pow(clamp(linear, 0.0, 1.0), vec3(1.0 / 2.2));
}

void main() {
  vec3 seen = plane * vec3(gl_FragCoord.xy, 1.0);
  vec2 at = seen.xy / seen.z;
  vec2 uv = vec2(at.x / extent.x + 1.0, 1.0 - at.y / extent.y) / 2.0;
  bool isOther = at.x < split && other != 0;
  vec4 normal = texture(normalMap, uv);
  vec3 diffuse = texture(diffuseMap, uv).rgb;
  vec3 specular = texture(specularMap, uv).rgb;
  vec4 otherNormal = texture(otherNormalMap, uv);
  vec3 otherDiffuse = texture(otherDiffuseMap, uv).rgb;
  vec3 otherSpecular = texture(otherSpecularMap, uv).rgb;
  vec3 taken = texture(photo, uv).rgb;
  vec3 whiteHere = texture(white, uv).rgb;
  if (isOther && other == 1) {
    normal = otherNormal;
    diffuse = otherDiffuse;
    specular = otherSpecular;
  }
  vec3 n = normalize(normal.xyz);
  vec3 position = vec3(at, 0.0);
  vec3 offset = light - position;
  vec3 irradiance = PI * (hasWhite ? whiteHere : vec3(power / dot(offset, offset)));
  vec3 radiance = shade(n, normalize(offset), normalize(view - position), diffuse, normal.a,
                        specular, irradiance);
  vec3 result = encode(radiance * exposure);
  if (shown == 1) result = n * 0.5 + 0.5;
  if (shown == 2) result = encode(diffuse);
  if (shown == 3) result = vec3(normal.a);
  if (shown == 4) result = encode(specular);
  if (isOther && other == 2) result = encode(pow(taken, vec3(2.2)) * exposure);
  vec2 inside = clamp((extent * repeats - abs(at)) / fwidth(at) + 0.5, 0.0, 1.0);
  colour = vec4(mix(ground, result, seen.z > 0.0 ? inside.x * inside.y : 0.0), 1.0);
}`;

export class Relighter {
  /** @throws {Error} with a sentence for the reader if the browser has no WebGL2. */
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("This browser shows no WebGL2; open the file in another one.");
    this.gl = gl;
    this.program = link(gl, VERTEX, FRAGMENT);
    this.uniforms = new Map();
    this.blank = this.image(new Uint8Array(4), 1, 1);
  }

  /** Textures of unpacked maps. */
  material(maps) {
    const gl = this.gl;
    const chain = mipChain(maps);
    const textures = [0, 1, 2].map((number) => {
      const texture = newTexture(gl, gl.REPEAT, gl.LINEAR_MIPMAP_LINEAR);
      chain.forEach(({ width, height, textures }, level) =>
        gl.texImage2D(gl.TEXTURE_2D, level, gl.RGBA16F, width, height, 0, gl.RGBA, gl.FLOAT,
                      textures[number]));
      return texture;
    });
    const longest = Math.max(maps.width, maps.height);
    return { textures, extent: [maps.width / longest, maps.height / longest] };
  }

  /** A texture of bytes, or of an ImageBitmap if no size is given; row 0 is the top. */
  image(source, width, height) {
    const gl = this.gl;
    const texture = newTexture(gl, gl.CLAMP_TO_EDGE, gl.LINEAR_MIPMAP_LINEAR);
    if (width) {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, source);
    } else {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, source);
    }
    gl.generateMipmap(gl.TEXTURE_2D);
    return texture;
  }

  /** A coarse grid of linear RGB, n x n, interpolated. */
  grid(values, n) {
    const gl = this.gl;
    const texture = newTexture(gl, gl.CLAMP_TO_EDGE, gl.LINEAR);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB16F, n, n, 0, gl.RGB, gl.FLOAT, values);
    return texture;
  }

  /**
   * scene: material; light, view [x, y, z] in half sides; power, or white (a grid); exposure;
   * origin [x, y] of the canvas's lower left corner and step [x, y] of a pixel, or a plane as orbit.js has it;
   * optionally shown, repeats, ground, split with other (a material) or photo (an image).
   */
  draw(scene) {
    const gl = this.gl;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.useProgram(this.program);
    const other = scene.split === undefined ? 0 : scene.photo ? 2 : scene.other ? 1 : 0;
    const names = ["normalMap", "diffuseMap", "specularMap"];
    const others = ["otherNormalMap", "otherDiffuseMap", "otherSpecularMap"];
    const bound = [
      ...names.map((name, i) => [name, scene.material.textures[i]]),
      ...others.map((name, i) => [name, (scene.other ?? scene.material).textures[i]]),
      ["photo", scene.photo ?? this.blank],
      ["white", scene.white ?? this.blank],
    ];
    bound.forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(this.at(name), unit);
    });
    const { origin, step } = scene;
    gl.uniformMatrix3fv(this.at("plane"), false, scene.plane ?? [step[0], 0, 0, 0, step[1], 0, ...origin, 1]);
    gl.uniform2fv(this.at("extent"), scene.material.extent);
    for (const name of ["light", "view"]) gl.uniform3fv(this.at(name), scene[name]);
    gl.uniform3fv(this.at("ground"), scene.ground ?? [0, 0, 0]);
    gl.uniform1f(this.at("power"), scene.power ?? 1);
    gl.uniform1f(this.at("exposure"), scene.exposure ?? 1);
    gl.uniform1f(this.at("repeats"), scene.repeats ?? 1);
    gl.uniform1f(this.at("split"), scene.split ?? 0);
    gl.uniform1i(this.at("hasWhite"), scene.white ? 1 : 0);
    gl.uniform1i(this.at("other"), other);
    gl.uniform1i(this.at("shown"), Math.max(SHOWN.indexOf(scene.shown), 0));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  at(name) {
    if (!this.uniforms.has(name)) {
      this.uniforms.set(name, this.gl.getUniformLocation(this.program, name));
    }
    return this.uniforms.get(name);
  }
}

export function link(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
      throw new Error(`The graphics driver refuses the shader: ${gl.getShaderInfoLog(shader)}`);
    }
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(`The graphics driver refuses the program: ${gl.getProgramInfoLog(program)}`);
  }
  return program;
}

function newTexture(gl, wrap, minification) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wrap);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wrap);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, minification);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  const sharp = gl.getExtension("EXT_texture_filter_anisotropic"); // for a tilted view
  if (sharp) gl.texParameterf(gl.TEXTURE_2D, sharp.TEXTURE_MAX_ANISOTROPY_EXT, 4);
  return texture;
}

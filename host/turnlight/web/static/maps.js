// Maps as turnlight.export.pack writes them, and their mip chain.

// Planes in order: x and y of the normal, diffuse, roughness, specular.
const PLANES = 9;

/**
 * What `packed` writes.
 * @returns {Promise<{width, height, pixels: Float32Array}>} 9 numbers a pixel, row 0 on top.
 */
export function unpack({ data, ...head }) {
  return unpackPlanes(head, Uint8Array.from(atob(data), (character) => character.charCodeAt(0)));
}

/** What `packed_for_a_screen` writes, an ArrayBuffer; as `unpack`. */
export function unpackBytes(buffer) {
  const bytes = new Uint8Array(buffer);
  const end = bytes.indexOf(0x0a);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  return unpackPlanes(head, bytes.subarray(end + 1));
}

async function unpackPlanes({ width, height, bits }, deflated) {
  const bytes = await inflate(deflated);
  const count = width * height;
  const pixels = new Float32Array(count * PLANES);
  for (let plane = 0; plane < PLANES; plane++) {
    const low = 2 * plane * count;
    const full = 2 ** bits[plane] - 1;
    for (let row = 0, at = 0; row < height; row++) {
      for (let column = 0, value = 0; column < width; column++, at++) {
        value = (value + bytes[low + at] + 256 * bytes[low + count + at]) & 0xffff;
        const share = value / full;
        pixels[at * PLANES + plane] =
          plane < 2 ? share * 2 - 1 : plane === 5 ? share : share * share;
      }
    }
  }
  return { width, height, pixels };
}

/** The levels from full size to a single pixel, as three RGBA float arrays each. */
export function mipChain({ width, height, pixels }) {
  let level = moments(width, height, pixels);
  const chain = [toTextures(level)];
  while (level.width > 1 || level.height > 1) {
    level = halved(level);
    chain.push(toTextures(level));
  }
  return chain;
}

// What can be averaged: the normal as a vector, whose length tells the relief that is lost; alpha
// squared; both albedos.
const MEANS = 10;

function moments(width, height, pixels) {
  const means = new Float32Array(width * height * MEANS);
  for (let i = 0, p = 0, m = 0; i < width * height; i++, p += PLANES, m += MEANS) {
    const x = pixels[p];
    const y = pixels[p + 1];
    means[m] = x;
    means[m + 1] = y;
    means[m + 2] = Math.sqrt(Math.max(1 - x * x - y * y, 1e-4));
    means[m + 3] = pixels[p + 5] ** 4;
    for (let c = 0; c < 3; c++) {
      means[m + 4 + c] = pixels[p + 2 + c];
      means[m + 7 + c] = pixels[p + 6 + c];
    }
  }
  return { width, height, means };
}

function halved({ width, height, means }) {
  const columns = Math.max(width >> 1, 1);
  const rows = Math.max(height >> 1, 1);
  const half = new Float32Array(columns * rows * MEANS);
  for (let row = 0; row < rows; row++) {
    const [top, bottom] = [2 * row, Math.min(2 * row + 1, height - 1)];
    for (let column = 0; column < columns; column++) {
      const [left, right] = [2 * column, Math.min(2 * column + 1, width - 1)];
      const corners = [top * width + left, top * width + right];
      corners.push(bottom * width + left, bottom * width + right);
      const to = (row * columns + column) * MEANS;
      for (const corner of corners) {
        for (let k = 0; k < MEANS; k++) half[to + k] += means[corner * MEANS + k] / 4;
      }
    }
  }
  return { width: columns, height: rows, means: half };
}

// The mean normal at unit length; what its length lacks becomes roughness, as turnlight.export.resample
// has it.
function toTextures({ width, height, means }) {
  const [normal, diffuse, specular] = [0, 1, 2].map(() => new Float32Array(width * height * 4));
  for (let i = 0, m = 0; i < width * height; i++, m += MEANS) {
    const length = Math.hypot(means[m], means[m + 1], means[m + 2]);
    for (let c = 0; c < 3; c++) {
      normal[i * 4 + c] = means[m + c] / length;
      diffuse[i * 4 + c] = means[m + 4 + c];
      specular[i * 4 + c] = means[m + 7 + c];
    }
    const alpha2 = means[m + 3] + 2 * Math.max(1 - length, 0);
    normal[i * 4 + 3] = Math.min(alpha2, 1) ** 0.25;
  }
  return { width, height, textures: [normal, diffuse, specular] };
}

async function inflate(deflated) {
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// The four maps as flat pictures, as turnlight.capture.relight.shown has them.

const PLANES = 9;
const encode = (linear) => 255 * linear ** (1 / 2.2);
const COLOURS = {
  normal: (p, i) => {
    const [x, y] = [p[i], p[i + 1]];
    return [x, y, Math.sqrt(Math.max(1 - x * x - y * y, 0))].map((v) => 127.5 * (v + 1));
  },
  diffuse: (p, i) => [encode(p[i + 2]), encode(p[i + 3]), encode(p[i + 4])],
  roughness: (p, i) => [255 * p[i + 5], 255 * p[i + 5], 255 * p[i + 5]],
  specular: (p, i) => [encode(p[i + 6]), encode(p[i + 7]), encode(p[i + 8])],
};
export const FLATS = Object.keys(COLOURS);

/** One of FLATS onto a canvas. maps: as maps.js unpacks them. */
export function flat(canvas, { width, height, pixels }, name) {
  const image = new ImageData(width, height);
  const colour = COLOURS[name];
  for (let at = 0; at < width * height; at++) {
    image.data.set(colour(pixels, at * PLANES), at * 4);
    image.data[at * 4 + 3] = 255;
  }
  Object.assign(canvas, { width, height });
  canvas.getContext("2d").putImageData(image, 0, 0);
}

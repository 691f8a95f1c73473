// A camera that circles the sample: where it stands, and where on the sample each pixel of a canvas looks.

const CORNERS = [[-1, -1], [1, -1], [-1, 1], [1, 1]];
const MARGIN = 0.06;
export const STEEPEST = 1.2;

/**
 * turn: radians about the sample's middle, 0 from the operator's side; tilt: radians from straight above;
 * distance in half sides; width, height of the canvas. From above the sample fills a square canvas.
 * @returns {{view: number[], plane: number[], onSample: Function, onCanvas: Function}} plane: column-major
 * 3 x 3, from WebGL's pixels to the sample, homogeneous; onSample, onCanvas: to and from shares of the canvas,
 * from its upper left corner. onSample gives null above the horizon.
 */
export function orbit({ turn, tilt, distance, width, height }) {
  const [st, ct, sp, cp] = [Math.sin(turn), Math.cos(turn), Math.sin(tilt), Math.cos(tilt)];
  const view = [distance * sp * st, -distance * sp * ct, distance * cp];
  const right = [ct, st, 0];
  const up = [-cp * st, cp * ct, sp];
  const ahead = view.map((v) => -v);
  const flat = ([x, y]) => {
    const from = [x - view[0], y - view[1], -view[2]];
    const depth = dot(from, ahead) / distance;
    return [dot(from, right) * distance / depth, dot(from, up) * distance / depth];
  };
  const seen = CORNERS.map(flat);
  const [low, high] = [Math.min, Math.max].map((end) => [0, 1].map((i) => end(...seen.map((at) => at[i]))));
  const middle = low.map((l, i) => (l + high[i]) / 2);
  const half = high.map((t, i) => (t - low[i]) / 2 * (1 + MARGIN * sp));
  const scale = Math.max(half[0] / width, half[1] / height) * 2; // image plane per pixel
  // A pixel looks along ahead + right x + up y; where that meets z = 0 is linear in x, y and 1.
  const columns = [right, up, ahead].map((e) => [
    view[2] * e[0] - e[2] * view[0], view[2] * e[1] - e[2] * view[1], -e[2]]);
  const corner = [middle[0] - scale * width / 2, middle[1] - scale * height / 2];
  const first = columns[0].map((v) => v * scale);
  const second = columns[1].map((v) => v * scale);
  const third = columns[2].map((v, i) => v + columns[0][i] * corner[0] + columns[1][i] * corner[1]);
  return {
    view,
    plane: [...first, ...second, ...third],
    onSample(x, y) {
      const [px, py] = [x * width, (1 - y) * height];
      const [u, v, w] = third.map((t, i) => first[i] * px + second[i] * py + t);
      return w > 0 ? [u / w, v / w] : null;
    },
    onCanvas(at) {
      const [x, y] = flat(at);
      return [(x - corner[0]) / scale / width, 1 - (y - corner[1]) / scale / height];
    },
  };
}

function dot(a, b) {
  return a.reduce((sum, v, i) => sum + v * b[i], 0);
}

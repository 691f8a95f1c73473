// Which part of the sample the canvas shows. Lengths on the sample are in half sides, on screen in CSS pixels.

const LARGEST_ZOOM = 40;

export class Camera {
  /**
   * extent: a function that gives half the width and height of what is to be seen; margins: one that gives
   * the CSS pixels { sides, top, bottom } to leave free around it.
   */
  constructor(canvas, extent, margins) {
    this.canvas = canvas;
    this.extent = extent;
    this.margins = margins;
    this.centre = [0, 0];
    this.magnification = 1;
  }

  /** CSS pixels per half side. */
  get scale() {
    const [halfWidth, halfHeight] = this.extent();
    const { clientWidth, clientHeight } = this.canvas;
    const { sides, top, bottom } = this.margins();
    const width = Math.max(clientWidth - 2 * sides, 64);
    const height = Math.max(clientHeight - top - bottom, 64);
    return Math.min(width / halfWidth, height / halfHeight) / 2 * this.magnification;
  }

  get middle() {
    const { clientWidth, clientHeight } = this.canvas;
    const { top, bottom } = this.margins();
    return [clientWidth / 2, (clientHeight + top - bottom) / 2];
  }

  resize() {
    const ratio = Math.min(devicePixelRatio, 2);
    this.canvas.width = Math.round(this.canvas.clientWidth * ratio);
    this.canvas.height = Math.round(this.canvas.clientHeight * ratio);
  }

  reset() {
    this.centre = [0, 0];
    this.magnification = 1;
  }

  pan(x, y) {
    const { scale } = this;
    this.centre = this.kept([this.centre[0] - x / scale, this.centre[1] + y / scale]);
  }

  /** By a factor, about a point on screen that stays where it is. */
  zoom(factor, x, y) {
    const fixed = this.sampleAt(x, y);
    this.magnification = Math.min(Math.max(this.magnification * factor, 0.5), LARGEST_ZOOM);
    const moved = this.sampleAt(x, y);
    this.centre = this.kept(this.centre.map((c, i) => c + fixed[i] - moved[i]));
  }

  sampleAt(x, y) {
    const [middleX, middleY] = this.middle;
    const { scale } = this;
    return [this.centre[0] + (x - middleX) / scale, this.centre[1] - (y - middleY) / scale];
  }

  screenOf([x, y]) {
    const [middleX, middleY] = this.middle;
    const { scale } = this;
    return [middleX + (x - this.centre[0]) * scale, middleY - (y - this.centre[1]) * scale];
  }

  /** The sample's x at a share of the canvas's width. */
  xOf(share) {
    return this.sampleAt(share * this.canvas.clientWidth, 0)[0];
  }

  /** The part of a scene that says where the sample lies in the canvas. */
  window() {
    const { clientWidth, clientHeight, width, height } = this.canvas;
    const origin = this.sampleAt(0, clientHeight);
    const { scale } = this;
    return { origin, step: [clientWidth / width / scale, clientHeight / height / scale] };
  }

  kept(centre) {
    const extent = this.extent();
    return centre.map((c, i) => Math.min(Math.max(c, -extent[i]), extent[i]));
  }
}

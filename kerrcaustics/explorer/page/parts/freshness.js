// Whether what is shown belongs to what the controls say, and what is said until it does.

// Milliseconds without a word from the program after which it counts as lost, and those after which it is called anew.
const SILENCE = 5000;
const RENEWAL = 15000;
// Seconds that images of a star that moves may be late.
const QUICK = 0.4;

const sameCamera = (part, request) => !!part && cameraOf(part.request) === cameraOf(request);

// Curves and images are "current", "coarse", "old" or "none". Each holds the request that it answers.
function freshnessOf(request, { view, images }) {
  const quality = view?.answer.quality === "draft" ? "coarse" : "current";
  const isStar = sameCamera(images, request) && starKey(images.request) === starKey(request);
  return {
    curves: view ? (sameCamera(view, request) ? quality : "old") : "none",
    images: images ? (isStar ? "current" : "old") : "none",
  };
}

// A part of the sky for a picture behind the curves, [right, up, side] in degrees, that can be asked for.
function windowOf([x, y, side]) {
  const field = clamp(1.1 * side, 0.01, 250);
  return Math.hypot(x, y) + field / Math.SQRT2 > 179 ? [0, 0, 250] : [x, y, field];
}

// Whether a picture covers a window, with pixels that are small enough there.
function covers(picture, [x, y, field]) {
  if (!picture) return false;
  const reach = (picture[2] - field / 1.1) / 2 + 1e-9;
  return Math.abs(x - picture[0]) <= reach && Math.abs(y - picture[1]) <= reach && picture[2] <= 2 * field;
}

const isWhole = ({ curves, images }) => curves === "current" && images === "current";

// Numbers are called certified beside the camera and the star that they belong to, and nowhere else. While the star moves
// they are a moment old, and nothing is said of them. hasCounts: whether the counts are shown.
function badgeOf(freshness, counts, certified, { lost, seconds, dragging }) {
  const sum = `${counts.join(" + ")} images`;
  const isCurrent = freshness.images === "current";
  const isMoving = freshness.curves === "current" && freshness.images === "old" && seconds < QUICK && !lost;
  if ((isCurrent && dragging) || isMoving) return { text: sum, kind: "kc-working", hasCounts: true };
  if (isCurrent && certified) return { text: `✓ ${sum}, certified`, kind: "kc-sure", hasCounts: true };
  if (isCurrent) return { text: `! ${sum}, not certified`, kind: "kc-unsure", hasCounts: true };
  if (lost) return { text: "not computed: no connection", kind: "kc-unsure" };
  return { text: seconds < 1 ? "computing …" : `computing … ${Math.floor(seconds)} s`, kind: "kc-working" };
}

// A line about work that takes a while.
function workLine(progress, seconds) {
  if (!progress) return `Computing … ${Math.floor(seconds)} s`;
  return `${capital(progress.stage)} … ${Math.floor(progress.seconds)} s`;
}

// The first state of the page, before the program or the kernel of a notebook has said a word.
function waitingLine(waitsFor, seconds) {
  const line = `Waiting for the ${waitsFor} … ${Math.floor(seconds)} s`;
  return waitsFor === "kernel" && seconds >= 3 ? `${line}: it answers once the cells before have run` : line;
}

const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

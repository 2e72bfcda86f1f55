// Stars for the quiz, and the reason for the number of their images. No page is needed.

// Degrees over which a caustic extends that is seen without zooming.
const SEEN = 1;

// A star near a caustic, within its hull or a little beyond; without caustics, anywhere. Those that are seen come first.
function quizStar(curves, random) {
  const pick = (list) => list[Math.floor(random() * list.length)];
  const whole = curves.filter(({ celestial }) => celestial.length > 2);
  const extent = ({ celestial }) => span(celestial.map(([theta]) => theta)).reduce((low, high) => high - low);
  const seen = whole.filter((curve) => extent(curve) > SEEN);
  if (!whole.length || random() < 0.25) return rounded(Math.acos(1 - 2 * random()) / RAD, TURN * random());
  const { celestial } = pick(seen.length ? seen : whole);
  const [a, b] = [pick(celestial), pick(celestial)];
  const part = 1.3 * random() - 0.15;
  return rounded(...a.map((x, i) => x + part * (b[i] - x)));
}

// Not at a pole, where longitudes have no meaning.
const rounded = (theta, phi) => starAt(round(clamp(theta, 0.5, 179.5), 5), round(mod(phi, TURN), 5));

// Pairs that caustics add, by order: one image of each index is left without them. Index k has images of the pairs of
// orders k and k + 1.
function pairsOf(counts) {
  const pairs = [];
  for (const count of counts) pairs.push(count - 1 - (pairs.at(-1) ?? 0));
  return pairs;
}

function reasonOf(counts) {
  const line = (number, i) => {
    const pairs = number === 1 ? "one pair" : `${number} pairs`;
    const here = i + 1 < counts.length ? "" : ", of which index " + (i + 1) + " is not counted";
    return `The ${NAMES[i + 1]} caustic winds round this star and adds ${pairs} of index ${i} and ${i + 1}${here}.`;
  };
  const lines = pairsOf(counts).map((number, i) => (number > 0 ? line(number, i) : ""));
  const words = lines.filter(Boolean).join(" ");
  return words || "The star is outside all these caustics: it has one image of each index.";
}

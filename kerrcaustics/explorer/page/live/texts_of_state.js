// A state as text, its ranges, and the nearest one that there is: as state.py and limits.py have them. `rules` are
// theirs: ranges, choices, usual values, and the nearest radius by that of the horizon and its steps per unit.

// A number as Python's format "g" writes it.
function general(x, digits) {
  if (x === 0) return "0";
  const [mantissa, power] = x.toExponential(digits - 1).split("e");
  const plain = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (power >= -4 && power < digits) return plain(x.toFixed(Math.max(0, digits - 1 - power)));
  return `${plain(mantissa)}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
}
const digits12 = (x) => general(x, 12);

function addressOf(state, { usual }) {
  const text = (value) => encodeURIComponent(typeof value === "number" ? digits12(value) : value);
  return Object.keys(usual).map((name) => `${name}=${text(state[name])}`).join("&");
}

const hasOrbit = ({ velocity, spin }) => (velocity !== "static" && spin > 0) || velocity === "circular";

function commandsOf(state) {
  const { spin, radius, velocity, inclination, theta, phi, orders, size, frequency } = state,
    off = inclination === 90 ? "" : ` --inclination ${digits12(inclination)}`,
    camera = `--spin ${digits12(spin)} --radius ${digits12(radius)} --velocity ${velocity}${off}`,
    star = `--star ${digits12(theta)} ${digits12(phi)}`,
    most = `--max-index ${orders - 1}`,
    lines = [`caustics ${camera} --orders ${orders}`, `images ${camera} ${star} ${most}`];
  if (hasOrbit(state)) lines.push(`tracks ${camera} --star-theta ${digits12(theta)} ${most}`);
  if (size > 0) lines.push(`magnification ${camera} ${star} --size ${digits12(size)} ${most}`);
  if (frequency > 0) lines.push(`amplification ${camera} ${star} --frequency ${digits12(frequency)} ${most}`);
  return lines.map((line) => `kerrcaustics ${line}`);
}

function pythonOf({ spin, radius, velocity, inclination, theta, phi, orders, size, frequency }) {
  const radians = (degrees) => `math.radians(${digits12(degrees)})`,
    polar = inclination === 90 ? "math.pi / 2" : radians(inclination),
    about = `camera, (${radians(theta)}, ${radians(phi)})`,
    most = `max_index=${orders - 1})\n`;
  let lines = `import math\nimport kerrcaustics as kc\n\ncamera = kc.Camera(${digits12(spin)}, ${digits12(radius)}, ${polar}, '${velocity}')\n`;
  lines += `caustics = kc.caustics(camera, orders=${orders})\nimages = kc.star_images(${about}, ${most}`;
  if (size > 0) lines += `magnification = kc.magnification(${about}, size=${radians(size)}, ${most}`;
  return lines + (frequency > 0 ? `waves = kc.amplification(${about}, ${digits12(frequency)}, ${most}` : "");
}

// The reason why a camera cannot have a velocity, after "it"; no text if it can.
function obstacle(state, velocity) {
  try {
    return cameraOf({ ...state, velocity }) && "";
  } catch (error) {
    if (error.constructor !== Error) throw error;
    return error.message.replace("Argument `velocity` ", "");
  }
}

const nearestRadius = (spin, { nearest: [factor, steps] }) => Math.ceil(steps * factor * horizonOf(spin)) / steps;

function allowedOf(state, rules) {
  const { ranges, choices } = rules,
    velocity = Object.fromEntries(choices.velocity.map((name) => [name, obstacle(state, name)])),
    radius = [nearestRadius(state.spin, rules), ranges.radius[1]];
  return { ...ranges, radius, phi: [0, 360], size: [0, ranges.size[1]], frequency: [0, ranges.frequency[1]], velocity };
}

// The state with a camera that there is: not too near to the hole, and fiducial where its velocity cannot be.
function nearestState(state, rules) {
  const { spin, radius } = rules.ranges,
    isHole = state.spin >= 0 && state.spin <= spin[1] && state.radius >= radius[0],
    moved = isHole ? { ...state, radius: Math.max(state.radius, nearestRadius(state.spin, rules)) } : state;
  return moved.velocity !== "fiducial" && obstacle(moved, moved.velocity) ? { ...moved, velocity: "fiducial" } : moved;
}

function checkedState(given, rules) {
  const { ranges, choices, usual } = rules,
    state = { ...usual, ...given },
    [least, most] = ranges.orders;
  for (const [name, words] of Object.entries(choices))
    if (!words.includes(state[name]))
      throw Error(`Argument \`${name}\` must be one of ${words.join(", ")}, but is ${`'${state[name]}'`.slice(0, 40)}.`);
  if (!Number.isInteger(state.orders) || state.orders < least || state.orders > most)
    throw Error(`Argument \`orders\` must be a whole number from ${least} to ${most}, but is ${state.orders}.`);
  const found = nearestState(state, rules);
  for (const [name, [low, high]] of Object.entries(ranges))
    if (!(found[name] >= low && found[name] <= high) && !(["size", "frequency"].includes(name) && found[name] === 0))
      throw Error(`Argument \`${name}\` must lie in [${general(low, 6)}, ${general(high, 6)}], but is ${digits12(found[name])}.`);
  cameraOf(found);
  return found;
}

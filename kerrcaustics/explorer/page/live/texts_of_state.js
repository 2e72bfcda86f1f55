// A state as text, its ranges, and the nearest one that there is: as state.py and limits.py have them. `rules` are
// theirs: ranges, choices, the values that are usual, the factor and the digits of the nearest radius.

// A number as Python's format "g" writes it.
function general(x, digits) {
  if (x === 0) return "0";
  const [mantissa, power] = x.toExponential(digits - 1).split("e");
  const plain = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (power >= -4 && power < digits) return plain(Number(x).toFixed(Math.max(0, digits - 1 - power)));
  return `${plain(mantissa)}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
}
const digits12 = (x) => general(x, 12);

function addressOf(state, { usual }) {
  const text = (value) => encodeURIComponent(typeof value === "number" ? digits12(value) : value);
  return Object.keys(usual).map((name) => `${name}=${text(state[name])}`).join("&");
}

const hasOrbit = ({ velocity, spin }) => (velocity !== "static" && spin > 0) || velocity === "circular";
const placeText = ({ theta, phi }) => `${digits12(theta)} ${digits12(phi)}`;

function commandsOf(state) {
  const { spin, radius, velocity, inclination, theta, orders, size, frequency } = state,
    off = inclination === 90 ? "" : ` --inclination ${digits12(inclination)}`,
    camera = `--spin ${digits12(spin)} --radius ${digits12(radius)} --velocity ${velocity}${off}`,
    star = `--star ${placeText(state)}`,
    most = `--max-index ${orders - 1}`;
  return [
    `kerrcaustics caustics ${camera} --orders ${orders}`,
    `kerrcaustics images ${camera} ${star} ${most}`,
    ...(hasOrbit(state) ? [`kerrcaustics tracks ${camera} --star-theta ${digits12(theta)} ${most}`] : []),
    ...(size > 0 ? [`kerrcaustics magnification ${camera} ${star} --size ${digits12(size)} ${most}`] : []),
    ...(frequency > 0 ? [`kerrcaustics amplification ${camera} ${star} --frequency ${digits12(frequency)} ${most}`] : []),
  ];
}

function pythonOf(state) {
  const { spin, radius, velocity, inclination, theta, phi, orders, size, frequency } = state,
    radians = (degrees) => `math.radians(${digits12(degrees)})`,
    polar = inclination === 90 ? "math.pi / 2" : radians(inclination),
    star = `(${radians(theta)}, ${radians(phi)})`,
    most = `max_index=${orders - 1}`;
  return [
    "import math",
    "import kerrcaustics as kc",
    "",
    `camera = kc.Camera(${digits12(spin)}, ${digits12(radius)}, ${polar}, '${velocity}')`,
    `caustics = kc.caustics(camera, orders=${orders})`,
    `images = kc.star_images(camera, ${star}, ${most})`,
    ...(size > 0 ? [`magnification = kc.magnification(camera, ${star}, size=${radians(size)}, ${most})`] : []),
    ...(frequency > 0 ? [`waves = kc.amplification(camera, ${star}, ${digits12(frequency)}, ${most})`] : []),
    "",
  ].join("\n");
}

// The reason why a camera cannot have a velocity, after "it"; no text if it can.
function obstacle(state, velocity) {
  try {
    cameraOf({ ...state, velocity });
    return "";
  } catch (error) {
    if (error.constructor !== Error) throw error;
    return error.message.replace("Argument `velocity` ", "");
  }
}

const nearestRadius = (spin, { nearest: [factor, scale] }) => Math.ceil(scale * factor * horizonOf(spin)) / scale;

function allowedOf(state, rules) {
  const { ranges, choices } = rules;
  const velocity = Object.fromEntries(choices.velocity.map((name) => [name, obstacle(state, name)]));
  const from = { size: [0, ranges.size[1]], frequency: [0, ranges.frequency[1]], phi: [0, 360] };
  return { ...ranges, ...from, radius: [nearestRadius(state.spin, rules), ranges.radius[1]], velocity };
}

// The state with a camera that there is: not too near to the hole, and fiducial where its velocity cannot be.
function nearestState(given, rules) {
  const { ranges } = rules,
    state = { ...given };
  if (state.spin >= 0 && state.spin <= ranges.spin[1] && state.radius >= ranges.radius[0])
    state.radius = Math.max(state.radius, nearestRadius(state.spin, rules));
  if (state.velocity !== "fiducial" && obstacle(state, state.velocity)) state.velocity = "fiducial";
  return state;
}

function checkedState(given, rules) {
  const { ranges, choices, usual } = rules,
    state = { ...usual, ...given };
  for (const [name, words] of Object.entries(choices))
    if (!words.includes(state[name]))
      throw Error(`Argument \`${name}\` must be one of ${words.join(", ")}, but is ${`'${state[name]}'`.slice(0, 40)}.`);
  const [least, most] = ranges.orders;
  if (!Number.isInteger(state.orders) || state.orders < least || state.orders > most)
    throw Error(`Argument \`orders\` must be a whole number from ${least} to ${most}, but is ${state.orders}.`);
  const found = nearestState(state, rules);
  for (const [name, [low, high]] of Object.entries(ranges))
    if (!(found[name] >= low && found[name] <= high) && !(["size", "frequency"].includes(name) && found[name] === 0))
      throw Error(`Argument \`${name}\` must lie in [${general(low, 6)}, ${general(high, 6)}], but is ${digits12(found[name])}.`);
  cameraOf(found);
  return found;
}

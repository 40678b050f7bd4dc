// Numbers for people, in mm or inch.

const INCH = 25.4;
let inch = false;

export const isInch = () => inch;
export function setInch(value) {
  inch = value;
}
export const lengthUnit = () => (inch ? 'in' : 'mm');

/** A number with a fixed number of decimals, `–` where it is not known. */
export function fixed(value, decimals) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  const text = value.toFixed(decimals);
  return /^-0(\.0*)?$/.test(text) ? text.slice(1) : text.replace('-', '−');
}

/** A length in mm, with its unit unless `bare`. */
export function length(mm, decimals = 3, bare = false) {
  if (mm === null || mm === undefined || !Number.isFinite(mm)) return '–';
  const text = inch ? fixed(mm / INCH, decimals + 1) : fixed(mm, decimals);
  return bare ? text : `${text} ${lengthUnit()}`;
}

/** A figure in its unit; lengths follow the choice of unit. */
export function figure(value, unit, decimals = 3) {
  if (unit === 'mm') return length(value, decimals);
  if (unit === 'mm/min') return speed(value);
  return `${fixed(value, decimals)} ${unit}`.trim();
}

/** A speed in mm/min. */
export function speed(mmMin, bare = false) {
  if (mmMin === null || mmMin === undefined || !Number.isFinite(mmMin)) return '–';
  const text = inch ? fixed(mmMin / INCH, 1) : fixed(mmMin, 0);
  return bare ? text : `${text} ${inch ? 'in/min' : 'mm/min'}`;
}

/** Seconds as 1:02:03, with tenths below a minute. */
export function clock(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return '–';
  if (seconds < 60) return `${seconds.toFixed(1)} s`;
  const whole = Math.round(seconds);
  const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (n) => String(n).padStart(2, '0');
  return hours ? `${hours}:${two(minutes)}:${two(rest)} h` : `${minutes}:${two(rest)} min`;
}

/** Value of an axis: mm, or degrees of a rotary one. */
export function axisValue(axis, value, decimals = 3) {
  return axis.is_rotary ? `${fixed((value * 180) / Math.PI, decimals)}°` : length(value, decimals);
}

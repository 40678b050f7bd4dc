// Document and arrays of the page.

/** Reads the document. */
export function readDocument() {
  const doc = JSON.parse(document.getElementById('document').textContent);
  (doc.result.findings || []).forEach((finding, k) => (finding.isFault = doc.finding_faults[k] !== false));
  return doc;
}

function bytesOf(index) {
  const element = document.getElementById(`array-${index}`);
  const text = atob(element.textContent.trim());
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  element.remove();
  return bytes;
}

async function inflated(index) {
  const stream = new Blob([bytesOf(index)]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Decodes a number array into a typed array; numbers that are not known become NaN. */
export async function numbers(array, Type = Float64Array) {
  if (!array) return null;
  const bytes = await inflated(array.array);
  const values = new Type(array.n);
  const { unit, offset, gaps } = array;
  let at = 0;
  let whole = 0;
  for (let k = 0; k < array.n; k++) {
    let byte = bytes[at++];
    let raw = byte & 127;
    if (byte >= 128) {
      // Beyond 32 bits shifts would wrap: powers of two go on.
      let scale = 128;
      do {
        byte = bytes[at++];
        raw += (byte & 127) * scale;
        scale *= 128;
      } while (byte >= 128);
    }
    whole += raw % 2 ? -(raw + 1) / 2 : raw / 2;
    values[k] = gaps && whole === 0 ? NaN : offset + whole * unit;
  }
  return values;
}

/** Decodes bytes. */
export const bytes = (array) => inflated(array.array);

/** Decodes x, y and z into one array of triples. */
export async function triples(arrays, Type = Float32Array) {
  const planes = await Promise.all(arrays.map((array) => numbers(array)));
  const all = new Type(planes[0].length * 3);
  for (let k = 0; k < planes[0].length; k++) {
    for (let c = 0; c < 3; c++) all[3 * k + c] = planes[c][k];
  }
  return all;
}

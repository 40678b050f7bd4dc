// Lines of the program as they are written: of a text with its calls expanded, those of several files.

/** File and line in which a line of the text is written; null where the text is a file as it is. */
export function writtenPlace(written, line) {
  if (!written || !written.length) return null;
  let [low, high] = [0, written.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (written[middle].first_line <= line) low = middle;
    else high = middle;
  }
  const run = written[low];
  return { file: run.file, line: run.line + line - run.first_line };
}

/** A line as a person finds it: of a program whose calls were expanded, in the written file. */
export function linePlace(doc, line) {
  const place = writtenPlace(doc.program.written, line);
  return place ? `${place.file} line ${place.line}` : `file line ${line}`;
}

/** Lines of a range as a person finds them. */
export function linePlaces(doc, first, last) {
  const [from, to] = [first, last].map((line) => writtenPlace(doc.program.written, line));
  if (!from) return `file lines ${first} to ${last}`;
  return `${from.file} line ${from.line} to ${to.file === from.file ? '' : `${to.file} line `}${to.line}`;
}

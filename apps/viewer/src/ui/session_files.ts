// Files that were chosen or dropped: a recording, or a session's directory with its recording and its report.

export interface SessionFiles {
  recording: File | null;
  /** report.json or hdr_report.json. */
  report: File | null;
}

const REPORT = /^(hdr_)?report\.json$/;

/** The first recording and the first report; any other single file is taken as a recording, which says what it is. */
export function sessionFiles(files: readonly File[]): SessionFiles {
  const report = files.find(({name}) => REPORT.test(name)) ?? null;
  const recording = files.find(({name}) => name.endsWith('.brachy')) ?? (files.length === 1 && !report ? files[0]! : null);
  return {recording, report};
}

/** Of a drop, with those in directories. Call it while the event is handled. */
export async function droppedFiles(transfer: DataTransfer): Promise<File[]> {
  const entries = [...transfer.items].flatMap((item) => item.webkitGetAsEntry() ?? []);
  const given = [...transfer.files];
  if (!entries.some(({isDirectory}) => isDirectory)) return given;
  return (await Promise.all(entries.map(filesOf))).flat();
}

async function filesOf(entry: FileSystemEntry): Promise<File[]> {
  if (entry.isFile) return [await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject))];
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  const files: FileSystemEntry[] = [];
  for (;;) {  // a hundred at a time
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) break;
    files.push(...some.filter(({isFile}) => isFile));
  }
  return (await Promise.all(files.map(filesOf))).flat();
}

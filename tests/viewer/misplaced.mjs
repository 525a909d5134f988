// What is cut off or covered in a page, and the sizes at which nothing may be.

/** The last two are 1366 × 768 and 1920 × 1080 at 200 %. */
export const SIZES = [[390, 844], [844, 390], [768, 1024], [1024, 768], [1280, 720], [1366, 768], [1920, 1080], [2560, 1440], [683, 384], [960, 540]];

/** Elements that are cut off, or lie over another, in the page as it is shown. */
export const misplaced = (page) => page.evaluate(() => {
  const found = [];
  const name = (element) => `${element.tagName.toLowerCase()}${element.id ? `#${element.id}` : ''} "${(element.textContent ?? '').trim().slice(0, 30)}"`;
  const shown = (element) => element.checkVisibility({checkVisibilityCSS: true, checkOpacity: true}) && element.getBoundingClientRect().width > 0;
  /** The nearest ancestor that scrolls in a direction, whose content may be longer than itself. */
  const scrolls = (element, axis) => {
    for (let host = element.parentElement; host && host !== document.body; host = host.parentElement)
      if (/auto|scroll/.test(getComputedStyle(host)[`overflow${axis}`])) return host;
    return null;
  };
  const parts = [...document.querySelectorAll('button, select, input, output, dd, dt, h1, h2, h3, p, li, label, summary, th, td, .pill, canvas')].filter(shown);
  for (const element of parts) {
    const box = element.getBoundingClientRect();
    const [beyondX, beyondY] = [scrolls(element, 'X'), scrolls(element, 'Y')];
    // Nothing scrolls sideways: also what is in a panel that scrolls stays within its width.
    const [left, right] = beyondX ? [beyondX.getBoundingClientRect().left, beyondX.getBoundingClientRect().right] : [0, innerWidth];
    if (box.left < left - 1 || box.right > right + 1) found.push(`${name(element)} is cut off sideways: ${Math.round(box.left)} to ${Math.round(box.right)} of ${Math.round(left)} to ${Math.round(right)}`);
    if (!beyondY && (box.top < -1 || box.bottom > innerHeight + 1)) found.push(`${name(element)} is cut off: ${Math.round(box.top)} to ${Math.round(box.bottom)} of ${innerHeight}`);
    if (element.matches('button, label, h2, h3, dd, dt, output') && element.scrollWidth > element.clientWidth + 1 && getComputedStyle(element).display !== 'inline')
      found.push(`${name(element)}: ${element.scrollWidth} px of text in ${element.clientWidth}`);
  }
  const drawerOf = (element) => {
    const host = element.closest('#left.open, #right.open');
    return host && getComputedStyle(host).position === 'absolute' ? host : null;
  };
  // Of things to press none lies over another; in a panel that scrolls only what is in sight counts.
  const press = [...document.querySelectorAll('button, select, input, summary')].filter(shown).filter((element) => {
    const box = element.getBoundingClientRect();
    const host = scrolls(element, 'Y')?.getBoundingClientRect();
    return !host || (box.top >= host.top && box.bottom <= host.bottom);
  });
  for (const [i, a] of press.entries()) {
    const one = a.getBoundingClientRect();
    for (const b of press.slice(0, i)) {
      const two = b.getBoundingClientRect();
      if (drawerOf(a) !== drawerOf(b)) continue;  // a drawer lies over the scene, as drawers do
      const across = Math.min(one.right, two.right) - Math.max(one.left, two.left);
      const down = Math.min(one.bottom, two.bottom) - Math.max(one.top, two.top);
      if (across > 2 && down > 2 && !a.contains(b) && !b.contains(a)) found.push(`${name(a)} lies over ${name(b)}`);
    }
  }
  return found;
});

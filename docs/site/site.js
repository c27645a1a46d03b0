// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A button that copies a block of code.
'use strict';
async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch { // without the right to the clipboard: by a selection
    const area = Object.assign(document.createElement('textarea'), { value: text });
    document.body.append(area);
    area.select();
    document.execCommand('copy');
    area.remove();
  }
}
document.addEventListener('DOMContentLoaded', () => {
  for (const block of document.querySelectorAll('div.highlight')) {
    const button = Object.assign(document.createElement('button'), { className: 'copy', type: 'button', textContent: 'copy' });
    button.addEventListener('click', async () => {
      await copyText(block.querySelector('pre').textContent);
      button.textContent = 'copied';
      setTimeout(() => { button.textContent = 'copy'; }, 1500);
    });
    block.append(button);
  }
});

import './style.css';
import { readData } from './data.js';
import { Scene } from './scene.js';
import { Panel } from './panel.js';

async function start() {
  const data = await readData(document.getElementById('its-data').textContent);
  const scene = new Scene(document.getElementById('canvas'), data);
  new Panel(scene, data);
  requestAnimationFrame(() => requestAnimationFrame(() => (document.documentElement.dataset.ready = 'true')));
}

start().catch((error) => {
  const message = document.getElementById('message');
  message.hidden = false;
  message.textContent = `The model cannot be shown: ${error.message}. This page needs a browser with WebGL 2.`;
  console.error(error);
});

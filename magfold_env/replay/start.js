// The page of one recorded fold: its texts and its player.

function fillTexts(data) {
  byId("word").textContent = data.word || "(one component)";
  byId("status").textContent = data.status;
  byId("status").dataset.status = data.status;
  byId("message").textContent = data.message;
  for (const [name, value] of data.facts) {
    write("dt", name, byId("facts"));
    write("dd", value, byId("facts"));
  }
  const [x, y] = data.field?.uniform ?? [0, 0];
  if (x || y) {
    const arrow = byId("arrow");
    arrow.hidden = false;
    arrow.querySelector("svg").style.transform = `rotate(${-Math.atan2(y, x)}rad)`;
    arrow.querySelector("span").textContent = `field ${Number(Math.hypot(x, y).toPrecision(3))} mT`;
  }
}

const data = JSON.parse(byId("fold").textContent);
fillTexts(data);
new Player().load(new Motion(data));

import "./style/style.css";
import { h } from "./dom";

document.body.append(h("main", { text: "all robots" }));

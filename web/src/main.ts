import "./fstop_app.ts";

<<<<<<<< HEAD:web/dist/assets/may-bHuus6_f.js
import{q as a,X as n,Y as l,Z as r,$ as i}from"./index-CigrGPjH.js";function u(e,s){const t=l(s,i).roles.map(o=>r[o]);return e.some(o=>t.includes(o))}function m(e){const s=a(n);return s.is==="in"&&u(s.session.roles,e)}export{m as u};
========
import{P as a,X as n,Y as l,Z as r,$ as i}from"./index-jziAdNtK.js";function u(e,s){const t=l(s,i).roles.map(o=>r[o]);return e.some(o=>t.includes(o))}function m(e){const s=a(n);return s.is==="in"&&u(s.session.roles,e)}export{m as u};
>>>>>>>> a135d3e (Whether corrections were right: cut against predicted by machine, offered as a known offset and never applied):web/dist/assets/may-Bc2-GEtS.js

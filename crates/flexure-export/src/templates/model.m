{% set kinds = steps | map(attribute="kind") | list %}
function y = {{ name }}(u)
% {{ name }}  The output of the model for the samples u: {{ "a row or a column" if inputs == 1 else "a matrix of " ~ inputs ~ " columns, one an input" }}.
{% for line in about %}% {{ line }}
{% endfor %}
{% if inputs == 1 %}
  if ~isvector(u) && ~isempty(u)
    error('{{ name }}: the input must be a row or a column');
  end
  samples = numel(u);
  y = nan(size(u));
  u = u(:);
{% else %}
  if size(u, 2) ~= {{ inputs }}
    error('{{ name }}: the input must have {{ inputs }} columns');
  end
  samples = size(u, 1);
  y = nan(samples, 1);
{% endif %}
{% for s in steps %}
{% for t in s.tables %}
  {{ t.name }}{{ s.k }} = [{% for line in t.lines %} ...
    {{ line }}{{ "" if loop.last else "," }}{% endfor %}];
{% endfor %}
{% if s.kind == "linear" %}
  s{{ s.k }} = zeros(1, {{ s.order + 1 }});
  level{{ s.k }} = 0;
{% elif s.kind == "surface" %}
  axes{{ s.k }} = [{% for a in s.axes %}{{ a.low }}, {{ a.high }}, {{ a.pieces }}; {% endfor %}];
{% elif s.kind == "feedback" %}
  g{{ s.k }} = struct('n', {{ s.order }}, 'A', A{{ s.k }}, 'Bu', Bu{{ s.k }}, 'Bw', Bw{{ s.k }}, 'Cy', Cy{{ s.k }}, 'Cz', Cz{{ s.k }}, ...
    'x', x{{ s.k }}, 'y', y{{ s.k }}, 'outside', {{ s.outside }}, 'input', {{ s.input }}, 'nonlinearity', {{ s.nonlinearity }}, ...
    'output', {{ s.output }}, 'entering', {{ s.entering }}, 'yu', {{ s.input_to_output }}, 'yw', {{ s.nonlinearity_to_output }}, ...
    'zu', {{ s.input_to_nonlinearity }}, 'limit', {{ s.limit }});
  s{{ s.k }} = zeros(1, {{ s.order }});
  away{{ s.k }} = false;
{% elif s.kind == "narx" %}
  past{{ s.k }} = zeros(1, {{ s.outputs }});
  u{{ s.k }} = zeros(1, {{ s.delay + s.inputs }});
{% elif s.kind == "volterra" %}
  u{{ s.k }} = zeros(1, {{ s.delay + s.memory }});
{% endif %}
{% endfor %}
  for n = 1:samples
{% for i in range(inputs) %}
    r{{ i }} = u(n, {{ i + 1 }});
{% endfor %}
{% for s in steps %}
{% set input = "r" ~ s.from[0] %}
{% if s.kind == "curve" %}
    r{{ s.to }} = {{ name }}_curve(x{{ s.k }}, y{{ s.k }}, {{ s.outside }}, {{ input }});
{% elif s.kind == "linear" %}
{% if s.steady %}
    if n == 1
      level{{ s.k }} = {{ input }};
    end
{% endif %}
    [r{{ s.to }}, s{{ s.k }}] = {{ name }}_linear(b{{ s.k }}, a{{ s.k }}, s{{ s.k }}, {{ input }} - level{{ s.k }});
    r{{ s.to }} = r{{ s.to }} + {{ s.gain }} * level{{ s.k }};
{% elif s.kind == "surface" %}
    r{{ s.to }} = {{ name }}_surface(axes{{ s.k }}, c{{ s.k }}, [{% for r in s.from %}r{{ r }}{{ "" if loop.last else ", " }}{% endfor %}]);
{% elif s.kind == "sum" %}
    r{{ s.to }} = {% for r in s.from %}r{{ r }}{{ "" if loop.last else " + " }}{% endfor %};
{% elif s.kind == "offset" %}
    r{{ s.to }} = {{ input }} + {{ s.offset }};
{% elif s.kind == "feedback" %}
    if n == 1
      s{{ s.k }} = {{ name }}_rest(g{{ s.k }}, {{ input }});
    end
    r{{ s.to }} = NaN;
    if ~away{{ s.k }}
      [r{{ s.to }}, z, s{{ s.k }}] = {{ name }}_loop(g{{ s.k }}, s{{ s.k }}, {{ input }});
      if ~(abs(r{{ s.to }}) <= {{ s.limit }} && abs(z) <= {{ s.limit }})
        away{{ s.k }} = true;
        r{{ s.to }} = NaN;
      end
    end
{% elif s.kind == "narx" %}
    u{{ s.k }} = [({{ input }} - {{ s.u_mean }}) / {{ s.u_spread }}, u{{ s.k }}];
    u{{ s.k }} = u{{ s.k }}(1:{{ s.delay + s.inputs }});
    lagged = [past{{ s.k }}, u{{ s.k }}({{ s.delay + 1 }}:end)];
    terms = 0;
    at = 0;
    for i = 1:{{ s.terms }}
      product = 1;
      for k = 1:lengths{{ s.k }}(i)
        at = at + 1;
        product = product * lagged(factors{{ s.k }}(at) + 1);
      end
      terms = terms + c{{ s.k }}(i) * product;
    end
    value = {{ s.constant }} + terms;
    if isnan(value) % what is no number counts as the mean
      value = {{ s.held_mean }};
    end
    value = min(max(value, {{ s.low }}), {{ s.high }});
    past{{ s.k }} = [value, past{{ s.k }}];
    past{{ s.k }} = past{{ s.k }}(1:{{ s.outputs }});
    r{{ s.to }} = {{ s.y_mean }} + {{ s.y_spread }} * value;
{% else %}
    u{{ s.k }} = [{{ input }} - {{ s.level }}, u{{ s.k }}];
    u{{ s.k }} = u{{ s.k }}(1:{{ s.delay + s.memory }});
    recent = u{{ s.k }}({{ s.delay + 1 }}:end);
    r{{ s.to }} = {{ s.constant }} + sum(h1{{ s.k }} .* recent(1:{{ s.first }}));
    for i = 1:{{ s.second }}
      r{{ s.to }} = r{{ s.to }} + recent(i) * sum(h2{{ s.k }}({{ s.second }} * (i - 1) + (1:{{ s.second }})) .* recent(1:{{ s.second }}));
    end
{% endif %}
{% endfor %}
    y(n) = r{{ output }};
  end
end
{% if "curve" in kinds or "feedback" in kinds %}

function value = {{ name }}_curve(x, y, outside, u)
% A function that is straight between the points of a table; outside: 0 NaN, 1 the nearest end's value, 2 straight on.
  last = numel(x);
  if isnan(u)
    value = NaN;
    return
  end
  if u < x(1) || u > x(last)
    first = u < x(1);
    if outside == 0
      value = NaN;
      return
    end
    if outside == 1 || last == 1
      if first
        value = y(1);
      else
        value = y(last);
      end
      return
    end
    if first
      i = 1;
    else
      i = last - 1;
    end
  elseif last == 1
    value = y(1);
    return
  else
    i = 1;
    len = last - 1;
    while len > 1
      half = floor(len / 2);
      if x(i + half) <= u
        i = i + half;
      end
      len = len - half;
    end
  end
  share = (u - x(i)) / (x(i + 1) - x(i));
  value = y(i) + share * (y(i + 1) - y(i));
end
{% endif %}
{% if "linear" in kinds %}

function [y, s] = {{ name }}_linear(b, a, s, v)
% A linear system in transposed direct form II; the last state stays zero.
  y = b(1) * v + s(1);
  s(1:end-1) = s(2:end) + b(2:end) * v - a(2:end) * y;
end
{% endif %}
{% if "surface" in kinds %}

function value = {{ name }}_surface(axes, c, x)
% A tensor product of cubic B-splines over a box, held at its nearest point outside.
  if any(isnan(x))
    value = NaN;
    return
  end
  index = 0;
  weight = 1;
  for i = 1:size(axes, 1)
    pieces = axes(i, 3);
    place = min(max((x(i) - axes(i, 1)) / (axes(i, 2) - axes(i, 1)) * pieces, 0), pieces);
    first = min(floor(place), pieces - 1);
    t = place - first;
    s = 1 - t;
    v = [s^3 / 6; (3 * t^3 - 6 * t^2 + 4) / 6; (-3 * t^3 + 3 * t^2 + 3 * t + 1) / 6; t^3 / 6];
    index = reshape(repmat(index(:).' * (pieces + 3) + first, 4, 1) + repmat((0:3).', 1, numel(index)), 1, []);
    weight = reshape(v * weight(:).', 1, []);
  end
  value = sum(weight .* c(index + 1));
end
{% endif %}
{% if "feedback" in kinds %}
{% set loop_step = steps | selectattr("kind", "equalto", "feedback") | first %}

function [y, z, x] = {{ name }}_loop(g, x, input)
% One sample of a loop: the output, what enters the nonlinearity, and the next state.
  u = input - g.input;
  z = g.entering + sum(g.Cz .* x) + g.zu * u;
  w = {{ name }}_curve(g.x, g.y, g.outside, z) - g.nonlinearity;
  y = g.output + sum(g.Cy .* x) + g.yu * u + g.yw * w;
  x = x * reshape(g.A, g.n, g.n) + g.Bu * u + g.Bw * w;
end

function x = {{ name }}_rest(g, u)
% The state in which a loop rests under a constant input; zero if it does not come to rest.
  x = zeros(1, g.n);
  for k = 1:{{ loop_step.longest_rest }}
    before = x;
    [y, ~, x] = {{ name }}_loop(g, x, u);
    if ~(abs(y) <= g.limit)
      break
    end
    if all(abs(x - before) <= {{ loop_step.at_rest }} * max(abs(x)))
      return
    end
  end
  x = zeros(1, g.n);
end
{% endif %}
